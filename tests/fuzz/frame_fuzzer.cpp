// Decodes any bytes as a frame after a small frame of voxels and after one of ellipsoids with a mask,
// within a memory limit, unchanged and with corrected checksums. A frame that is accepted must be
// encoded to bytes that decode to the same content.

#include <cstdint>
#include <cstdlib>
#include <span>

#include "codec/continued_frames.h"
#include "esvr/error.h"
#include "esvr/frame_coding.h"
#include "esvr/grid_coding.h"
#include "fit/volumes.h"
#include "fuzz/repair.h"

namespace {

constexpr std::uint64_t kMaxContent = std::uint64_t{256} << 20;

esvr::SparseVolume volume() { return esvr::test::tubeVolume(); }

esvr::EsvrFile frameOfVoxels() {
  auto layer = esvr::boundedLayer(volume(), 0.02, esvr::Activity::kByValue);
  return {{}, {esvr::makeStoredVoxels({}, volume(), std::move(layer))}};
}

esvr::EsvrFile frameOfEllipsoids() {
  const esvr::SparseVolume mask = volume();
  esvr::StoredGrid grid;
  grid.quantised.push_back(esvr::test::firstFrame(40));
  grid.field.chunks.push_back({{}, esvr::dequantise(grid.quantised[0])});
  grid.topology = esvr::TopologyKind::kMask;
  grid.mask = mask.active;
  for (std::size_t b = 0; b < mask.brickCount(); ++b) grid.bricks.push_back(mask.brickCorner(b));
  return {{}, {std::move(grid)}};
}

esvr::EsvrFile frameOfLevels() {
  esvr::EsvrFile frame = frameOfEllipsoids();
  esvr::StoredGrid& grid = frame.grids[0];
  grid.topology = esvr::TopologyKind::kBlocks;
  grid.activeThreshold = 0.01f;
  grid.mask.clear();
  grid.levels.resize(grid.bricks.size());
  return frame;
}

void decodeAndEncode(std::span<const std::byte> bytes, const esvr::EsvrFile& previous) {
  try {
    const auto frame = esvr::decodeFrame(bytes, "fuzz", {kMaxContent}, &previous);
    const auto once = esvr::encodeFrame(frame, &previous);
    const auto again = esvr::decodeFrame(once, "again", {}, &previous);
    if (esvr::encodeFrame(again, &previous) != once) std::abort();
  } catch (const esvr::BadInput&) {
  } catch (const esvr::MemoryExceeded&) {
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto bytes = std::as_bytes(std::span(data, size));
  static const esvr::EsvrFile frames[] = {frameOfVoxels(), frameOfEllipsoids(), frameOfLevels()};
  for (const esvr::EsvrFile& previous : frames) {
    decodeAndEncode(bytes, previous);
    decodeAndEncode(esvr::fuzz::repaired(bytes), previous);
  }
  return 0;
}
