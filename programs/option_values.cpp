// The values of options: numbers, sizes, bounds and boxes; names of the enumerations that files hold, what tells grids of one
// name apart, and bytes of grids.

#include "programs/option_values.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>

#include "esvr/did_you_mean.h"

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
constexpr Unit kUnits[] = {{"", 1.0},       {"b", 1.0},     {"kb", 1e3},     {"mb", 1e6},
                           {"gb", 1e9},     {"tb", 1e12},   {"kib", 0x1p10}, {"mib", 0x1p20},
                           {"gib", 0x1p30}, {"tib", 0x1p40}};
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

// ---- Names of grids

std::string nameOf(ValueType type) {
  return wordOf(
      type,
      {{"half", ValueType::kHalf}, {"double", ValueType::kDouble}, {"float", ValueType::kFloat}});
}

std::string nameOf(KernelForm form) { return form == KernelForm::kPaper ? "paper" : "continuous"; }

std::string nameOf(TopologyKind kind) {
  return wordOf(kind, {{"bricks", TopologyKind::kBricks},
                       {"mask", TopologyKind::kMask},
                       {"threshold", TopologyKind::kThreshold}});
}

std::string activityOf(const StoredGrid& grid) {
  if (grid.topology == TopologyKind::kMask) return "a mask";
  return "threshold " + shortNumber(grid.activeThreshold);
}

std::string textOf(const NonFiniteCounts& counts) {
  std::string text;
  const auto add = [&](std::uint64_t count, const char* kind) {
    if (count > 0) text += (text.empty() ? "" : " and ") + std::to_string(count) + " " + kind;
  };
  add(counts.nan, "NaN");
  add(counts.plusInfinity, "+infinity");
  add(counts.minusInfinity, "-infinity");
  return text + (counts.total() == 1 ? " voxel" : " voxels");
}

std::string valuesOf(const GridSummary& grid) {
  return grid.savedAsHalf ? grid.valueType + " as half" : grid.valueType;
}

std::string activeVoxelsOf(const GridSummary& grid) {
  return grid.isScalar || grid.activeVoxels > 0 ? std::to_string(grid.activeVoxels) : "-";
}

namespace {

GridTraits traitsOf(const GridSummary& grid) {
  return {grid.name, grid.valueType, grid.gridClass, grid.activeVoxels, grid.activeBox};
}

/// The traits of the grid of a .vdb file that is stored so.
GridTraits traitsOf(const EsvrFile& file, const GridOfFile& grid) {
  if (grid.isCarried) {
    const CarriedGrid& carried = file.carried[grid.index];
    if (carried.bytes.empty()) return {.name = carried.name};  // they were not read
    return traitsOf(inspectCarried(carried));
  }
  const StoredGrid& first = file.grids[grid.isVector ? file.vectors[grid.index].first : grid.index];
  const bool isDouble = first.descriptor.valueType == ValueType::kDouble;
  GridTraits traits{nameOf(file, grid), isDouble ? "double" : "float", first.descriptor.gridClass,
                    first.activeVoxels, first.activeBox};
  if (grid.isVector) traits.valueType = isDouble ? "vec3d" : "vec3s";
  traits.values = {first.valueMin, first.valueMax};
  return traits;
}

}  // namespace

std::vector<GridTraits> traitsOf(const VdbSummary& file) {
  std::vector<GridTraits> traits;
  for (const GridSummary& grid : file.grids) traits.push_back(traitsOf(grid));
  return traits;
}

std::vector<GridTraits> traitsOf(const EsvrFile& file) {
  std::vector<GridTraits> traits;
  for (const GridOfFile& grid : gridsInOrder(file)) traits.push_back(traitsOf(file, grid));
  return traits;
}

void addRanges(std::span<const GridTraits> other,
               const std::function<std::optional<std::array<float, 2>>(std::size_t)>& rangeOf,
               std::vector<GridTraits>& traits) {
  std::map<std::string, std::size_t> counts, others;
  for (const GridTraits& grid : traits) ++counts[grid.name];
  for (const GridTraits& grid : other) ++others[grid.name];
  for (std::size_t g = 0; g < traits.size(); ++g) {
    const auto there = others.find(traits[g].name);
    const bool isNeeded = there != others.end() && there->second != counts[traits[g].name];
    if (isNeeded && !traits[g].values) traits[g].values = rangeOf(g);
  }
}

std::uint64_t bytesIf(const EsvrSummary& file,
                      const std::function<bool(const SectionSummary&)>& counts) {
  std::uint64_t bytes = 0;
  for (const SectionSummary& section : file.sections)
    if (counts(section)) bytes += section.storedBytes;
  return bytes;
}

std::uint64_t storedBytes(const EsvrSummary& file, std::size_t grid) {
  return bytesIf(file, [&](const auto& section) { return section.grid == grid; });
}

std::uint64_t ownBytes(const EsvrSummary& file, std::size_t grid) {
  return bytesIf(file,
                 [&](const auto& section) { return section.grid == grid && !section.sharedWith; });
}

}  // namespace esvr::cli
