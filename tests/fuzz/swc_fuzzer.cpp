// Reads skeletons. If a skeleton is accepted, its links lead to its nodes.

#include <cstdint>
#include <cstdlib>
#include <sstream>

#include "esvr/error.h"
#include "generators/skeleton.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::istringstream text(std::string(reinterpret_cast<const char*>(data), size));
  try {
    const auto skeleton = esvr::samples::parseSwc(text, "fuzz");
    for (const auto& node : skeleton)
      if (node.parent && *node.parent >= skeleton.size()) std::abort();
    (void)esvr::samples::tubesOf(skeleton);
    if (esvr::samples::longestPieces(skeleton, 1).size() > skeleton.size()) std::abort();
  } catch (const esvr::BadInput&) {
  }
  return 0;
}
