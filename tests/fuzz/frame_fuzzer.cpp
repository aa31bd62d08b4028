// Decodes any bytes as a frame after a small frame of voxels, within a memory limit, unchanged and with
// corrected checksums. A frame that is accepted must be encoded to bytes that decode to the same
// content.

#include <cstdint>
#include <cstdlib>
#include <span>

#include "esvr/error.h"
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
  static const esvr::EsvrFile previous = frameOfVoxels();
  decodeAndEncode(bytes, previous);
  decodeAndEncode(esvr::fuzz::repaired(bytes), previous);
  return 0;
}
