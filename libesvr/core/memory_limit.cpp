#include "esvr/memory_limit.h"

#include <cstdio>

#include "esvr/error.h"

namespace esvr {
namespace {

std::string sizeText(double bytes) {
  constexpr double kMega = 1e6, kGiga = 1e9;
  char text[32];
  if (bytes < kGiga)
    std::snprintf(text, sizeof text, "%.3g MB", bytes / kMega);
  else
    std::snprintf(text, sizeof text, "%.3g GB", bytes / kGiga);
  return text;
}

}  // namespace

void requireWithinMemory(double neededBytes, std::uint64_t maxBytes, const std::string& what) {
  if (neededBytes <= double(maxBytes)) return;
  throw MemoryExceeded(what + " asks for up to " + sizeText(neededBytes) + " of memory, and " +
                       sizeText(double(maxBytes)) + " are allowed");
}

}  // namespace esvr
