#include "esvr/memory_limit.h"

#include "core/byte_text.h"
#include "esvr/error.h"

namespace esvr {

void requireWithinMemory(double neededBytes, std::uint64_t maxBytes, const std::string& what) {
  if (neededBytes <= double(maxBytes)) return;
  throw MemoryExceeded(what + " asks for up to " + byteText(neededBytes) + " of memory, and " +
                       byteText(double(maxBytes)) + " are allowed");
}

}  // namespace esvr
