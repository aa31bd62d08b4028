#include "render/vector_option.h"

#include "cli/number_list.h"

namespace esvr::render {

std::optional<Vec3> findVector(const cli::Arguments& arguments, const std::string& option) {
  const auto text = arguments.find<std::string>(option);
  if (!text) return std::nullopt;
  const auto v = cli::parseNumbers(option, *text, 3);
  return Vec3{v[0], v[1], v[2]};
}

}  // namespace esvr::render
