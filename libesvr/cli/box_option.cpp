#include "cli/box_option.h"

#include <array>
#include <cstdint>

#include "cli/number.h"
#include "esvr/error.h"

namespace esvr::cli {
namespace {

[[noreturn]] void refuse(const std::string& option, const std::string& text, const char* why) {
  throw UsageError("--" + option + " must be x0,y0,z0,x1,y1,z1, six whole numbers: '" + text +
                   "' " + why);
}

}  // namespace

Box parseBox(const std::string& text, const std::string& option) {
  const auto parts = splitText(text, ',');
  std::array<std::int32_t, 6> n{};
  if (parts.size() < n.size()) refuse(option, text, "has fewer");
  if (parts.size() > n.size()) refuse(option, text, "has more");
  for (std::size_t i = 0; i < n.size(); ++i) {
    const auto number = parseWhole(parts[i]);
    if (!number || *number != std::int32_t(*number)) refuse(option, text, "has something else");
    n[i] = std::int32_t(*number);
  }
  const Box box{{n[0], n[1], n[2]}, {n[3], n[4], n[5]}};
  if (box.empty()) refuse(option, text, "has no voxel in it");
  return box;
}

}  // namespace esvr::cli
