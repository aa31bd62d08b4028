// Reads PLY files of splats and evaluates them. What is accepted has finite numbers and unit quaternions.

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <span>

#include "esvr/error.h"
#include "esvr/splats.h"

namespace {

constexpr std::uint64_t kMaxBytes = std::uint64_t{16} << 20;

void check(const esvr::Splats& splats) {
  for (std::size_t i = 0; i < splats.size(); ++i) {
    float square = 0.0f;
    for (const auto& q : splats.rotation) square += q[i] * q[i];
    bool isFinite =
        std::abs(square - 1.0f) < 1e-5f && splats.alpha[i] > 0.0f && splats.alpha[i] <= 1.0f;
    for (std::size_t a = 0; a < 3; ++a)
      isFinite =
          isFinite && std::isfinite(splats.center[a][i]) && std::isfinite(splats.logScale[a][i]);
    if (!isFinite) std::abort();
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    const auto file =
        esvr::parseSplats(std::as_bytes(std::span(data, size)), "fuzz", {.maxBytes = kMaxBytes});
    check(file.scene.splats);
    if (file.scene.splats.size() + file.dropped != file.inFile) std::abort();
    const auto grids = esvr::makeSplatGrids(file.scene, {.voxelSize = 1.0, .maxBytes = kMaxBytes});
    for (const float v : grids.density.volume.values)
      if (!std::isfinite(v)) std::abort();
  } catch (const esvr::Error&) {
  }
  return 0;
}
