#include "compare/differences.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "cli/names.h"
#include "cli/table.h"
#include "esvr/grid_names.h"

namespace esvr::compare {
namespace {

/// OpenVDB's metadata items that repeat members of a descriptor.
const std::array<std::string, 3> kRepeated{"name", "class", "is_saved_as_half_float"};

constexpr double kEntryTolerance = 1e-12;  // relative to the largest entry: float64 rounding

using Matrix = std::array<double, 16>;

double largestEntry(const Matrix& m) {
  double largest = 0.0;
  for (const double entry : m) largest = std::max(largest, std::abs(entry));
  return largest;
}

double largestDifference(const Matrix& a, const Matrix& b) {
  double largest = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) largest = std::max(largest, std::abs(a[i] - b[i]));
  return largest;
}

class Differences {
 public:
  void add(DifferenceKind kind, const std::string& what, const std::string& reference,
           const std::string& candidate) {
    if (reference != candidate) list_.push_back({kind, what + ": " + reference + ", " + candidate});
  }
  void addTransform(const Transform& a, const Transform& b);
  std::vector<Difference> take() { return std::move(list_); }

 private:
  std::vector<Difference> list_;
};

void Differences::addTransform(const Transform& a, const Transform& b) {
  if (a == b) return;
  std::string how;
  if (a.affine && b.affine) {
    const double by = largestDifference(*a.affine, *b.affine);
    if (by <= kEntryTolerance * std::max(largestEntry(*a.affine), largestEntry(*b.affine))) return;
    how = " (matrices differ by up to " + cli::shortNumber(by) + ")";
  }
  list_.push_back(
      {DifferenceKind::kTransform, "transform: " + a.mapType + ", another " + b.mapType + how});
}

std::map<std::string, const MetaItem*> byName(std::span<const MetaItem> items) {
  std::map<std::string, const MetaItem*> found;
  for (const auto& item : items) found[item.name] = &item;
  return found;
}

Difference metadataDifference(const std::string& name, const std::string& how) {
  return {DifferenceKind::kMetadata,
          "metadata \"" + shownText(name, LineEnds::kReplace) + "\": " + how};
}

}  // namespace

std::vector<Difference> compareMetadata(std::span<const MetaItem> reference,
                                        std::span<const MetaItem> candidate,
                                        std::span<const std::string> ignored) {
  const auto isIgnored = [&](const std::string& name) {
    return std::find(ignored.begin(), ignored.end(), name) != ignored.end();
  };
  const auto a = byName(reference), b = byName(candidate);
  std::vector<Difference> differences;
  for (const auto& [name, item] : a) {
    if (isIgnored(name)) continue;
    const auto other = b.find(name);
    if (other == b.end())
      differences.push_back(metadataDifference(name, "missing"));
    else if (*other->second != *item)
      differences.push_back(metadataDifference(name, "another value"));
  }
  for (const auto& [name, item] : b)
    if (!isIgnored(name) && !a.contains(name))
      differences.push_back(metadataDifference(name, "not in the reference"));
  return differences;
}

std::vector<Difference> compareInactive(const InactiveValues& reference,
                                        const InactiveValues& candidate) {
  if (reference == candidate) return {};
  const auto text = [](const InactiveValues& values) {
    return values.count() == 0 ? "none" : toText(values);
  };
  return {{DifferenceKind::kInactive,
           "inactive values that are not the background: " + text(reference) +
               ", in the candidate " + text(candidate)}};
}

std::vector<Difference> compareDescriptors(const GridDescriptor& a, const GridDescriptor& b) {
  Differences differences;
  differences.add(DifferenceKind::kName, "name", '"' + a.name + '"', '"' + b.name + '"');
  differences.add(DifferenceKind::kClass, "class", className(a.gridClass), className(b.gridClass));
  differences.add(DifferenceKind::kValueType, "value type", cli::nameOf(a.valueType),
                  cli::nameOf(b.valueType));
  if (a.background != b.background)
    differences.add(DifferenceKind::kBackground, "background", cli::shortNumber(a.background),
                    cli::shortNumber(b.background) + " (by " +
                        cli::shortNumber(b.background - a.background) + ")");
  differences.addTransform(a.transform, b.transform);
  auto list = differences.take();
  const auto metadata = compareMetadata(a.metadata, b.metadata, kRepeated);
  list.insert(list.end(), metadata.begin(), metadata.end());
  return list;
}

}  // namespace esvr::compare
