// Reads messages of the viewer's clients. A request that is accepted has a picture of a size that the
// viewer allows, and numbers within their bounds.

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "esvr/error.h"
#include "render/view/requests.h"

namespace {

using namespace esvr;

void require(bool holds) {
  if (!holds) std::abort();
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

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
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
