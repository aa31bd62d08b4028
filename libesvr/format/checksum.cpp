#include "format/checksum.h"

#include <xxhash.h>

namespace esvr::format {

std::uint64_t checksum(std::span<const std::byte> bytes) {
  return XXH64(bytes.data(), bytes.size(), 0);
}

}  // namespace esvr::format
