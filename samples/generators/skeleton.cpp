#include "generators/skeleton.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <numeric>
#include <sstream>
#include <string_view>
#include <unordered_map>

#include "esvr/error.h"

namespace esvr::samples {

// Reading.

namespace {

constexpr std::size_t kColumns = 7;
constexpr std::int64_t kNoParent = -1;

/// A node with the numbers of its line.
struct SwcLine {
  std::size_t number = 0;  ///< number of the line, from 1
  std::int64_t id = 0, parent = 0;
  SkeletonNode node;
};

class SwcParser {
 public:
  explicit SwcParser(std::string name) : name_(std::move(name)) {}

  Skeleton parse(std::istream& text) {
    std::string line;
    for (std::size_t number = 1; std::getline(text, line); ++number) addLine(line, number);
    if (text.bad()) throw BadInput(name_ + ": reading failed before the end of the file");
    if (lines_.empty()) throw BadInput(name_ + ": the file has no node; it may not be an SWC file");
    return link();
  }

 private:
  void addLine(std::string_view text, std::size_t number) {
    const auto columns = split(text.substr(0, text.find('#')), number);
    if (columns.empty()) return;
    SwcLine line{.number = number,
                 .id = integer(columns[0], number),
                 .parent = integer(columns[6], number),
                 .node = {}};
    line.node.position = {real(columns[2], number), real(columns[3], number),
                          real(columns[4], number)};
    line.node.radius = real(columns[5], number);
    if (line.node.radius < 0.0) refuse(number, "the radius is negative");
    if (line.id < 0) refuse(number, "the node's id is negative");
    if (!byId_.emplace(line.id, lines_.size()).second)
      refuse(number, "node " + std::to_string(line.id) + " is defined twice");
    lines_.push_back(line);
  }

  /// Links the nodes after all are read, since parents may come after their children.
  Skeleton link() const {
    Skeleton skeleton;
    skeleton.reserve(lines_.size());
    for (const SwcLine& line : lines_) {
      skeleton.push_back(line.node);
      if (line.parent != kNoParent) skeleton.back().parent = parentOf(line);
    }
    return skeleton;
  }

  std::size_t parentOf(const SwcLine& line) const {
    if (line.parent == line.id) refuse(line.number, "the node is its own parent");
    const auto found = byId_.find(line.parent);
    if (found == byId_.end())
      refuse(line.number, "its parent " + std::to_string(line.parent) + " does not exist");
    return found->second;
  }

  std::vector<std::string_view> split(std::string_view text, std::size_t number) const {
    constexpr std::string_view kBlank = " \t\r\f\v";
    std::vector<std::string_view> columns;
    for (auto at = text.find_first_not_of(kBlank); at != text.npos;) {
      const auto end = std::min(text.find_first_of(kBlank, at), text.size());
      columns.push_back(text.substr(at, end - at));
      at = text.find_first_not_of(kBlank, end);
    }
    if (!columns.empty() && columns.size() < kColumns)
      refuse(number, "a node needs 7 columns, but the line has " + std::to_string(columns.size()));
    return columns;
  }

  template <class Number>
  Number number(std::string_view text, std::size_t line) const {
    if (!text.empty() && text.front() == '+') text.remove_prefix(1);
    Number value{};
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size())
      refuse(line, "'" + std::string(text) + "' is not a number of the type of this column");
    return value;
  }
  std::int64_t integer(std::string_view text, std::size_t line) const {
    return number<std::int64_t>(text, line);
  }
  double real(std::string_view text, std::size_t line) const {
    const auto value = number<double>(text, line);
    if (!std::isfinite(value)) refuse(line, "'" + std::string(text) + "' is not finite");
    return value;
  }

  [[noreturn]] void refuse(std::size_t line, const std::string& why) const {
    throw BadInput(name_ + ", line " + std::to_string(line) + ": " + why);
  }

  std::string name_;
  std::vector<SwcLine> lines_;
  std::unordered_map<std::int64_t, std::size_t> byId_;
};

}  // namespace

Skeleton parseSwc(std::istream& text, const std::string& name) {
  return SwcParser(name).parse(text);
}

// Tubes and pieces.

namespace {

/// Disjoint sets of nodes.
class Pieces {
 public:
  explicit Pieces(std::size_t nodes) : above_(nodes) {
    std::iota(above_.begin(), above_.end(), std::size_t{0});
  }
  std::size_t of(std::size_t node) {
    while (above_[node] != node) node = above_[node] = above_[above_[node]];
    return node;
  }
  void join(std::size_t a, std::size_t b) { above_[of(a)] = of(b); }

 private:
  std::vector<std::size_t> above_;
};

double cableTo(const Skeleton& skeleton, const SkeletonNode& node) {
  return node.parent ? length(node.position - skeleton[*node.parent].position) : 0.0;
}

/// Length of cable of every piece, at the index of the piece's representative node.
std::vector<double> cableOf(const Skeleton& skeleton, Pieces& pieces) {
  std::vector<double> cable(skeleton.size(), 0.0);
  for (std::size_t i = 0; i < skeleton.size(); ++i)
    cable[pieces.of(i)] += cableTo(skeleton, skeleton[i]);
  return cable;
}

/// The kept nodes with the new indices of their parents.
Skeleton selected(const Skeleton& skeleton, const std::vector<bool>& keep) {
  std::vector<std::size_t> place(skeleton.size(), 0);
  for (std::size_t i = 1; i < skeleton.size(); ++i) place[i] = place[i - 1] + (keep[i - 1] ? 1 : 0);
  Skeleton kept;
  for (std::size_t i = 0; i < skeleton.size(); ++i) {
    if (!keep[i]) continue;
    kept.push_back(skeleton[i]);
    if (kept.back().parent) kept.back().parent = place[*kept.back().parent];
  }
  return kept;
}

std::vector<bool> hasLinks(const Skeleton& skeleton) {
  std::vector<bool> linked(skeleton.size(), false);
  for (std::size_t i = 0; i < skeleton.size(); ++i)
    if (skeleton[i].parent) linked[i] = linked[*skeleton[i].parent] = true;
  return linked;
}

}  // namespace

std::vector<Tube> tubesOf(const Skeleton& skeleton) {
  const auto linked = hasLinks(skeleton);
  std::vector<Tube> tubes;
  tubes.reserve(skeleton.size());
  for (std::size_t i = 0; i < skeleton.size(); ++i) {
    const SkeletonNode& node = skeleton[i];
    const SkeletonNode& end = node.parent ? skeleton[*node.parent] : node;
    if (node.parent || !linked[i])
      tubes.push_back({node.position, end.position, node.radius, end.radius});
  }
  return tubes;
}

Skeleton longestPieces(const Skeleton& skeleton, std::size_t count) {
  Pieces pieces(skeleton.size());
  for (std::size_t i = 0; i < skeleton.size(); ++i)
    if (skeleton[i].parent) pieces.join(i, *skeleton[i].parent);
  const auto cable = cableOf(skeleton, pieces);

  std::vector<std::size_t> heads;
  for (std::size_t i = 0; i < skeleton.size(); ++i)
    if (pieces.of(i) == i) heads.push_back(i);
  std::stable_sort(heads.begin(), heads.end(),
                   [&](std::size_t a, std::size_t b) { return cable[a] > cable[b]; });
  heads.resize(std::min(count, heads.size()));

  std::vector<bool> keptHead(skeleton.size(), false), keep(skeleton.size());
  for (const std::size_t head : heads) keptHead[head] = true;
  for (std::size_t i = 0; i < skeleton.size(); ++i) keep[i] = keptHead[pieces.of(i)];
  return selected(skeleton, keep);
}

}  // namespace esvr::samples
