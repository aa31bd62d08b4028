#include "cli/box_option.h"

#include <array>
#include <charconv>

#include "esvr/error.h"

namespace esvr::cli {
namespace {

[[noreturn]] void refuse(const std::string& option, const std::string& text, const char* why) {
  throw UsageError("--" + option + " must be x0,y0,z0,x1,y1,z1, six whole numbers: '" + text +
                   "' " + why);
}

}  // namespace

Box parseBox(const std::string& text, const std::string& option) {
  std::array<std::int32_t, 6> numbers{};
  const char* at = text.data();
  const char* const end = at + text.size();
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    if (i > 0 && (at == end || *at++ != ',')) refuse(option, text, "has fewer");
    const auto [next, error] = std::from_chars(at, end, numbers[i]);
    if (error != std::errc{}) refuse(option, text, "has something else");
    at = next;
  }
  if (at != end) refuse(option, text, "has more");
  const auto& n = numbers;
  const Box box{{n[0], n[1], n[2]}, {n[3], n[4], n[5]}};
  if (box.empty()) refuse(option, text, "has no voxel in it");
  return box;
}

}  // namespace esvr::cli
