#include "esvr/grid_names.h"

#include <algorithm>
#include <map>

#include "esvr/error.h"

namespace esvr {
namespace {

std::string numbered(const std::string& name, std::size_t i) {
  return name + "[" + std::to_string(i) + "]";
}

std::string quotedList(std::span<const std::string> names) {
  std::string list;
  for (const auto& name : names) list += (list.empty() ? "\"" : ", \"") + name + "\"";
  return list.empty() ? "none" : list;
}

/// Index of the first name for which asWritten(name) equals `wanted`; names.size() if there is
/// none.
template <class AsWritten>
std::size_t firstWhere(std::span<const std::string> names, const std::string& wanted,
                       AsWritten&& asWritten) {
  const auto it = std::find_if(names.begin(), names.end(),
                               [&](const std::string& name) { return asWritten(name) == wanted; });
  return std::size_t(it - names.begin());
}

}  // namespace

const char* className(GridClass gridClass) {
  switch (gridClass) {
    case GridClass::kLevelSet:
      return "level set";
    case GridClass::kFogVolume:
      return "fog volume";
    case GridClass::kStaggered:
      return "staggered";
    case GridClass::kUnknown:
      break;
  }
  return "unknown";
}

std::vector<std::string> uniqueNames(std::span<const std::string> names) {
  std::map<std::string, std::size_t> total, seen;
  for (const auto& name : names) ++total[name];
  std::vector<std::string> unique;
  for (const auto& name : names)
    unique.push_back(total[name] == 1 ? name : numbered(name, seen[name]++));
  return unique;
}

std::size_t findGrid(std::span<const std::string> names, const std::string& wanted,
                     const std::filesystem::path& file) {
  const auto unique = uniqueNames(names);
  const auto asIs = [](const std::string& name) { return name; };
  std::size_t i = firstWhere(unique, wanted, asIs);
  if (i == names.size()) i = firstWhere(names, wanted, asIs);
  if (i == names.size())
    i = firstWhere(names, wanted, [](const std::string& name) { return numbered(name, 0); });
  if (i == names.size())
    throw BadInput((file.empty() ? "" : file.string() + ": ") + "has no grid \"" + wanted +
                   "\"; there are: " + quotedList(unique));
  return i;
}

}  // namespace esvr
