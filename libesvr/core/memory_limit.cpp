#include "esvr/memory_limit.h"

#include <cstdio>

#include "esvr/error.h"

namespace esvr {
namespace {

std::string gigabytes(double bytes) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g GB", bytes / 1e9);
  return text;
}

}  // namespace

void requireWithinMemory(double neededBytes, std::uint64_t maxBytes, const std::string& what) {
  if (neededBytes <= double(maxBytes)) return;
  throw MemoryExceeded(what + " asks for up to " + gigabytes(neededBytes) + " of memory, and " +
                       gigabytes(double(maxBytes)) + " are allowed");
}

}  // namespace esvr
