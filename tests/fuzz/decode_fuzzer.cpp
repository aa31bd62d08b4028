// Decodes any bytes, unchanged and with corrected checksums, within a memory limit. A file that is
// accepted must be encoded to bytes that decode to the same content, and its grids become voxels or
// are refused.

#include <cstdint>
#include <cstdlib>
#include <span>

#include "esvr/container.h"
#include "esvr/error.h"
#include "esvr/grid_coding.h"
#include "format/bytes.h"
#include "format/decode.h"
#include "fuzz/repair.h"

namespace {

constexpr std::uint64_t kMaxContent = std::uint64_t{256} << 20, kMaxVoxels = std::uint64_t{8} << 20;

void decodeVoxels(const esvr::StoredGrid& grid) {
  try {
    esvr::checkInvariants(esvr::decodeGrid(grid, {.maxBytes = kMaxVoxels}));
  } catch (const esvr::MemoryExceeded&) {
  } catch (const esvr::RuntimeFailure&) {  // supports are 2^31 voxels apart
  }
}

void decodeAndEncode(std::span<const std::byte> bytes) {
  std::vector<std::byte> once;
  try {
    const esvr::EsvrFile file =
        esvr::format::decode(esvr::format::MemorySource(bytes, "fuzz"), {kMaxContent});
    for (const auto& grid : file.grids) decodeVoxels(grid);
    once = esvr::encodeEsvr(file);
  } catch (const esvr::BadInput&) {
    return;
  } catch (const esvr::MemoryExceeded&) {
    return;
  }
  if (esvr::encodeEsvr(esvr::decodeEsvr(once, "again")) != once) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto bytes = std::as_bytes(std::span(data, size));
  decodeAndEncode(bytes);
  decodeAndEncode(esvr::fuzz::repaired(bytes));
  return 0;
}
