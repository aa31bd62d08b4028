// Plan: what the programs read beside volumes gets any bytes: baselines, cameras, messages and skeletons.

#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>

#include "compare/check.h"
#include "esvr/camera.h"
#include "esvr/error.h"
#include "fuzz/fuzzer.h"
#include "generators/tubes.h"
#include "render/camera_file.h"
#include "render/view/requests.h"

namespace esvr::fuzz {
namespace {

/// Reads baselines of `esvr-compare check` and compares the record of one grid with them.
ESVR_FUZZER(baseline) {
  static InputFile file(".json");
  compare::CheckRecord record;
  record.candidateBytes = 1000;
  record.grids.push_back({.name = "density", .candidateName = "density"});
  record.grids[0].figures = compare::figuresOf(record.grids[0].metrics);
  const auto& path = file.write(data, size);
  try {
    (void)compare::baselineHasSsim(path);
    compare::judgeBaseline(path, record);
    compare::updateBaseline(path, record);
    compare::judgeBaseline(path, record);
  } catch (const BadInput&) {
  }
  return 0;
}

/// Reads cameras of esvr-render. A camera that is accepted and checked has finite positions.
ESVR_FUZZER(camera) {
  static InputFile file(".json");
  try {
    const CameraWish wish = render::readCamera(file.write(data, size));
    const Resolution resolution{64, 48};
    const Camera camera = fitCamera({{0, 0, 0}, {9, 9, 9}}, wish, resolution);
    checkCamera(camera, resolution);
    for (const double x : camera.eye) require(std::isfinite(x));
  } catch (const BadInput&) {
  } catch (const UsageError&) {
  }
  return 0;
}

void check(const view::PictureRequest& request) {
  require(request.size.width >= 1 && request.size.width <= view::kMaxPictureSide);
  require(request.size.height >= 1 && request.size.height <= view::kMaxPictureSide);
  const render::Options& o = request.scene.options;
  require(std::isfinite(o.step) && o.step > 0.0);
  require(std::isfinite(o.opacityLength) && o.opacityLength > 0.0);
}

template <class Read>
void read(const nlohmann::json& content, Read request) {
  try {
    request(content);
  } catch (const BadInput&) {
  } catch (const UsageError&) {
  }
}

/// Reads messages of the viewer's clients. A request that is accepted has a picture of a size that the
/// viewer allows, and numbers within their bounds.
ESVR_FUZZER(request) {
  const auto content = nlohmann::json::parse(data, data + size, nullptr, false);
  if (content.is_discarded()) return 0;
  read(content, [](const auto& json) {
    const view::DrawRequest request = view::drawRequestOf(json);
    require(request.quality >= 0.0 && request.quality <= 1.0);
    check(request.picture);
  });
  read(content, [](const auto& json) { check(view::pngRequestOf(json)); });
  return 0;
}

/// Reads skeletons. If a skeleton is accepted, its links lead to its nodes.
ESVR_FUZZER(swc) {
  std::istringstream text(std::string(reinterpret_cast<const char*>(data), size));
  try {
    const auto skeleton = samples::parseSwc(text, "fuzz");
    for (const auto& node : skeleton) require(!node.parent || *node.parent < skeleton.size());
    (void)samples::tubesOf(skeleton);
    require(samples::longestPieces(skeleton, 1).size() <= skeleton.size());
  } catch (const BadInput&) {
  }
  return 0;
}

}  // namespace
}  // namespace esvr::fuzz
