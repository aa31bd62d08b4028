// The values of options: numbers, sizes, bounds and boxes.
#include "programs/option_values.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdint>

#include "esvr/did_you_mean.h"
#include "esvr/error.h"

namespace esvr::cli {

void refuseWord(const std::string& option, const std::string& given,
                const std::vector<std::string>& words) {
  std::string known;
  for (const std::string& word : words) known += (known.empty() ? "" : ", ") + word;
  throw UsageError("--" + option + " must be one of " + known + ", not '" + given + "'" +
                   didYouMean(given, words));
}

std::vector<double> parseNumbers(const std::string& option, const std::string& text,
                                 std::size_t count) {
  const auto parts = splitText(text, ',');
  std::vector<double> numbers;
  for (const auto& part : parts)
    if (const auto number = parseNumber(part)) numbers.push_back(*number);
  if (parts.size() != count || numbers.size() != count)
    throw UsageError("--" + option + " must be " + std::to_string(count) +
                     " numbers with commas between, not '" + text + "'");
  return numbers;
}

namespace {

struct Unit {
  const char* name;
  double bytes;
};
constexpr Unit kUnits[] = {{"", 1.0},   {"b", 1.0},      {"kb", 1e3},     {"mb", 1e6},
                           {"gb", 1e9}, {"kib", 0x1p10}, {"mib", 0x1p20}, {"gib", 0x1p30}};
constexpr double kMaxBytes = 1e15;

std::string lowered(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return char(std::tolower(c)); });
  return text;
}

}  // namespace

std::uint64_t parseByteSize(const std::string& option, const std::string& text) {
  const auto refuse = [&] {
    return UsageError("--" + option + " must be a size such as 50000, 50KB or 2.6MB, not '" + text +
                      "'");
  };
  const auto number = parseLeadingNumber(text);
  if (!number) throw refuse();
  const std::string name = lowered(std::string(number->rest));
  const auto unit = std::find_if(std::begin(kUnits), std::end(kUnits),
                                 [&](const Unit& u) { return name == u.name; });
  if (unit == std::end(kUnits)) throw refuse();
  const double bytes = std::floor(number->value * unit->bytes);
  if (!(bytes >= 1.0 && bytes <= kMaxBytes)) throw refuse();
  return std::uint64_t(bytes);
}

std::uint64_t parseDeviceMemory(const std::string& option, const std::string& text) {
  constexpr double kLeastBytes = 1e6;
  const auto number = parseLeadingNumber(text);
  const bool isGigabytes =
      number && number->rest.empty() && number->value > 0.0 && number->value < kLeastBytes;
  const std::uint64_t bytes = parseByteSize(option, isGigabytes ? text + "GB" : text);
  if (double(bytes) < kLeastBytes)
    throw UsageError("--" + option + " must be at least 1MB, not '" + text + "'");
  return bytes;
}

ErrorBound parseErrorBound(const std::string& option, const std::string& text) {
  constexpr double kPercent = 100.0;
  const auto number = parseLeadingNumber(text);
  const bool relative = number && number->rest == "%";
  if (!number || !(number->value > 0.0) || !(relative || number->rest.empty()))
    throw UsageError("--" + option + " must be a number above 0 such as 0.01 or 1%, not '" + text +
                     "'");
  return {relative ? number->value / kPercent : number->value, relative};
}

RelativeBound parseRelativeBound(const std::string& option, const std::string& text) {
  const auto parts = splitText(text, ',');
  const auto refuse = [&] {
    return UsageError("--" + option +
                      " must be a share below 100% and, after a comma, a magnitude above 0, " +
                      "such as 1% or 1%,0.001, not '" + text + "'");
  };
  if (parts.size() > 2) throw refuse();
  RelativeBound bound{parseErrorBound(option, parts[0]).amount};
  if (!(bound.share < 1.0)) throw refuse();
  if (parts.size() == 1) return bound;
  bound.floor = parseNumber(parts[1]);
  if (!bound.floor || !(*bound.floor > 0.0) || !std::isfinite(float(*bound.floor))) throw refuse();
  return bound;
}

Box parseBox(const std::string& text, const std::string& option) {
  const auto refuse = [&](const char* why) {
    return UsageError("--" + option + " must be x0,y0,z0,x1,y1,z1, six whole numbers: '" + text +
                      "' " + why);
  };
  const auto parts = splitText(text, ',');
  std::array<std::int32_t, 6> n{};
  if (parts.size() < n.size()) throw refuse("has fewer");
  if (parts.size() > n.size()) throw refuse("has more");
  for (std::size_t i = 0; i < n.size(); ++i) {
    const auto number = parseWhole(parts[i]);
    if (!number || *number != std::int32_t(*number)) throw refuse("has something else");
    n[i] = std::int32_t(*number);
  }
  const Box box{{n[0], n[1], n[2]}, {n[3], n[4], n[5]}};
  if (box.empty()) throw refuse("has no voxel in it");
  return box;
}

}  // namespace esvr::cli
