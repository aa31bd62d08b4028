// Decodes any bytes as a frame after a small frame, within a memory limit, unchanged and with
// corrected checksums. A frame that is accepted must be encoded to bytes that decode to the same
// content.

#include <cstdint>
#include <cstdlib>
#include <span>

#include "esvr/error.h"
#include "esvr/frame_coding.h"
#include "esvr/grid_coding.h"
#include "fit/volumes.h"
#include "fuzz/repair.h"

namespace {

constexpr std::uint64_t kMaxContent = std::uint64_t{256} << 20;

const esvr::EsvrFile& previousFrame() {
  static const esvr::EsvrFile frame = [] {
    const esvr::SparseVolume volume = esvr::test::tubeVolume();
    auto layer = esvr::boundedLayer(volume, 0.02, esvr::Activity::kByValue);
    return esvr::EsvrFile{{}, {esvr::makeStoredVoxels({}, volume, std::move(layer))}};
  }();
  return frame;
}

void decodeAndEncode(std::span<const std::byte> bytes) {
  const esvr::EsvrFile& previous = previousFrame();
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
  decodeAndEncode(bytes);
  decodeAndEncode(esvr::fuzz::repaired(bytes));
  return 0;
}
