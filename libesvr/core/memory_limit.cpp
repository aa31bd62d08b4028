#include "esvr/memory_limit.h"

#include <unistd.h>

#include "core/byte_text.h"
#include "esvr/error.h"

namespace esvr {

std::uint64_t usualMemoryLimit() {
  const long pages = ::sysconf(_SC_PHYS_PAGES), pageBytes = ::sysconf(_SC_PAGESIZE);
  if (pages <= 0 || pageBytes <= 0) return kNoMemoryLimit;  // the system does not tell
  return std::uint64_t(pages) * std::uint64_t(pageBytes) / 2;
}

void requireWithinMemory(double neededBytes, std::uint64_t maxBytes, const std::string& what) {
  if (neededBytes <= double(maxBytes)) return;
  throw MemoryExceeded(what + " asks for up to " + byteText(neededBytes) + " of memory, and " +
                       byteText(double(maxBytes)) + " are allowed");
}

}  // namespace esvr
