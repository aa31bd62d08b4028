#include "esvr/device.h"

#include <unistd.h>

#include <cstdio>

#include "core/memory_budget.h"
#include "esvr/error.h"

namespace esvr {

std::string byteText(double bytes) {
  constexpr double kMega = 1e6, kGiga = 1e9;
  char text[32];
  if (bytes < kGiga)
    std::snprintf(text, sizeof text, "%.3g MB", bytes / kMega);
  else
    std::snprintf(text, sizeof text, "%.3g GB", bytes / kGiga);
  return text;
}

std::uint64_t usualMemoryLimit() {
#ifdef __EMSCRIPTEN__
  return kNoMemoryLimit;  // the pages below would be those that the module has now, and it gets more
#endif
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
