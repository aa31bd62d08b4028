// Decodes whatever comes, as it is and with its checksums made right. A file that is accepted must
// be written again to bytes that decode to the same.

#include <cstdint>
#include <cstdlib>
#include <span>

#include "esvr/container.h"
#include "esvr/error.h"
#include "fuzz/repair.h"

namespace {

void decodeAndEncode(std::span<const std::byte> bytes) {
  std::vector<std::byte> once;
  try {
    once = esvr::encodeEsvr(esvr::decodeEsvr(bytes, "fuzz"));
  } catch (const esvr::BadInput&) {
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
