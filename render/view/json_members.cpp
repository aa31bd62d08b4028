#include "render/view/json_members.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace esvr::view {

Members::Members(const json& object, std::string name) : object_(object), name_(std::move(name)) {
  if (!object.is_object()) throw BadInput("\"" + name_ + "\" must be an object");
}

void Members::requireKnown(std::initializer_list<std::string_view> names) const {
  for (const auto& [key, value] : object_.items())
    if (std::find(names.begin(), names.end(), key) == names.end()) refuse(key, "is not known");
}

const json* Members::find(const char* name) const {
  const auto found = object_.find(name);
  return found == object_.end() || found->is_null() ? nullptr : &*found;
}

const json& Members::at(const char* name) const {
  const json* const value = find(name);
  if (value == nullptr) refuse(name, "is missing");
  return *value;
}

std::optional<double> Members::number(const char* name) const {
  const json* const value = find(name);
  if (value == nullptr) return std::nullopt;
  if (!value->is_number()) refuse(name, "must be a number");
  return value->get<double>();
}

std::optional<double> Members::number(const char* name, double low, double high) const {
  const auto value = number(name);
  if (value && !(*value >= low && *value <= high))
    refuse(name, "must be from " + json(low).dump() + " to " + json(high).dump());
  return value;
}

std::optional<std::int64_t> Members::whole(const char* name, std::int64_t low,
                                           std::int64_t high) const {
  const auto value = number(name, double(low), double(high));
  if (!value) return std::nullopt;
  if (*value != std::floor(*value)) refuse(name, "must be a whole number");
  return std::int64_t(*value);
}

std::optional<bool> Members::flag(const char* name) const {
  const json* const value = find(name);
  if (value == nullptr) return std::nullopt;
  if (!value->is_boolean()) refuse(name, "must be true or false");
  return value->get<bool>();
}

std::optional<std::string> Members::text(const char* name) const {
  const json* const value = find(name);
  if (value == nullptr) return std::nullopt;
  if (!value->is_string()) refuse(name, "must be a text");
  return value->get<std::string>();
}

std::optional<Vec3> Members::vector(const char* name) const {
  const json* const value = find(name);
  if (value == nullptr) return std::nullopt;
  const auto v = numbersOf(*value, 3, nameOf(name));
  return Vec3{v[0], v[1], v[2]};
}

void Members::refuse(const std::string& name, const std::string& what) const {
  throw BadInput("\"" + nameOf(name) + "\" " + what);
}

std::vector<double> numbersOf(const json& array, std::size_t count, const std::string& name) {
  const bool fits =
      array.is_array() && array.size() == count &&
      std::all_of(array.begin(), array.end(), [](const json& v) { return v.is_number(); });
  if (!fits)
    throw BadInput("\"" + name + "\" must be a list of " + std::to_string(count) + " numbers");
  return array.get<std::vector<double>>();
}

}  // namespace esvr::view
