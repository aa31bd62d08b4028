#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <map>

#include "core/counted.h"
#include "esvr/did_you_mean.h"
#include "esvr/error.h"
#include "esvr/grid.h"

namespace esvr {
namespace {

constexpr const char* kUnnamed = "(unnamed)";
constexpr std::string_view kComponentLetters = "xyz";
/// The most grids that an error lists. More of them do not help, and a small file may have thousands.
constexpr std::size_t kMostListed = 20;

/// The number of bytes of the UTF-8 character at the begin of a text; 0 if there is none.
std::size_t characterAt(std::string_view text) {
  const auto byte = [&](std::size_t i) { return std::uint8_t(text[i]); };
  const std::size_t length = byte(0) < 0x80   ? 1
                             : byte(0) < 0xc2 ? 0
                             : byte(0) < 0xe0 ? 2
                             : byte(0) < 0xf0 ? 3
                             : byte(0) < 0xf5 ? 4
                                              : 0;
  if (length > text.size()) return 0;
  for (std::size_t i = 1; i < length; ++i)
    if ((byte(i) & 0xc0) != 0x80) return 0;
  const bool overlong = (byte(0) == 0xe0 && byte(1) < 0xa0) || (byte(0) == 0xf0 && byte(1) < 0x90);
  const bool beyond = (byte(0) == 0xed && byte(1) >= 0xa0) || (byte(0) == 0xf4 && byte(1) >= 0x90);
  return length > 1 && (overlong || beyond) ? 0 : length;
}

/// The code point of a valid UTF-8 character.
std::uint32_t codePointOf(std::string_view character) {
  const auto first = std::uint8_t(character[0]);
  if (character.size() == 1) return first;
  std::uint32_t point = first & (0x7fu >> character.size());
  for (std::size_t i = 1; i < character.size(); ++i)
    point = point << 6 | (std::uint8_t(character[i]) & 0x3fu);
  return point;
}

bool isControl(std::uint32_t point) { return point < 0x20 || (point >= 0x7f && point <= 0x9f); }

/// True for marks of the writing direction and for separators of lines and paragraphs.
bool movesText(std::uint32_t point) {
  return point == 0x061c || point == 0x200e || point == 0x200f ||
         (point >= 0x2028 && point <= 0x202e) || (point >= 0x2066 && point <= 0x2069);
}

std::string quotedList(std::span<const std::string> names) {
  std::string list;
  for (std::size_t n = 0; n < std::min(names.size(), kMostListed); ++n)
    list += (n == 0 ? "\"" : ", \"") + names[n] + '"';
  if (names.size() > kMostListed)
    list += " and " + std::to_string(names.size() - kMostListed) + " more";
  return list.empty() ? "none" : list;
}

std::string prefixOf(const std::filesystem::path& file) {
  return file.empty() ? "" : file.string() + ": ";
}

/// The number that all of a text is; nothing if it is none.
std::optional<std::size_t> wholeNumber(std::string_view digits) {
  std::size_t number = 0;
  const char* const end = digits.data() + digits.size();
  const auto [stop, error] = std::from_chars(digits.data(), end, number);
  if (digits.empty() || error != std::errc{} || stop != end) return std::nullopt;
  return number;
}

/// The most pairs of grids of one name that are compared by their traits, which takes memory for each.
/// Where there are more, grids are paired by their numbers.
constexpr std::size_t kMostCells = std::size_t{1} << 20;

/// How far ranges of values agree. A lossy conversion changes them by a few percent.
int agreementOfValues(const GridTraits& a, const GridTraits& b) {
  if (!a.values || !b.values) return 0;
  const auto& [low, high] = *a.values;
  const double scale =
      std::max({double(high) - low, std::abs(double(low)), std::abs(double(high))});
  const double difference = std::max(std::abs(double(b.values->front()) - low),
                                     std::abs(double(b.values->back()) - high));
  if (difference == 0.0) return 6;
  return difference <= 0.05 * scale ? 5 : 0;
}

int agreement(const GridTraits& a, const GridTraits& b) {
  // The type counts most, because a grid of another type is never the same grid.
  return agreementOfValues(a, b) + 16 * int(a.valueType == b.valueType) +
         int(a.gridClass == b.gridClass) + 2 * int(a.activeBox == b.activeBox) +
         2 * int(a.activeVoxels == b.activeVoxels);
}

/// Pairs grids of one name in order, so that the sum of agreements is largest. The first of equal
/// choices is taken.
class Alignment {
 public:
  using Places = std::vector<std::size_t>;

  Alignment(std::span<const GridTraits> reference, const Places& ofReference,
            std::span<const GridTraits> candidate, const Places& ofCandidate)
      : reference_(reference), candidate_(candidate), rows_(ofReference), columns_(ofCandidate) {}

  void pair(std::vector<std::optional<std::size_t>>& pairs) {
    const std::size_t both = std::min(rows_.size(), columns_.size());
    if (rows_.size() == columns_.size() || rows_.size() * columns_.size() > kMostCells) {
      for (std::size_t k = 0; k < both; ++k) pairs[rows_[k]] = columns_[k];
      return;
    }
    best_.assign((rows_.size() + 1) * (columns_.size() + 1), 0);
    for (std::size_t r = rows_.size(); r-- > 0;)
      for (std::size_t c = columns_.size(); c-- > 0;)
        best(r, c) = std::max({best(r + 1, c), best(r, c + 1), paired(r, c)});
    for (std::size_t r = 0, c = 0; r < rows_.size() && c < columns_.size();) {
      if (best(r, c) == paired(r, c))
        pairs[rows_[r++]] = columns_[c++];
      else
        best(r, c) == best(r + 1, c) ? ++r : ++c;
    }
  }

 private:
  int& best(std::size_t r, std::size_t c) { return best_[r * (columns_.size() + 1) + c]; }

  /// A pair counts more than any sum of traits, so that no grid stays alone without need.
  int paired(std::size_t r, std::size_t c) {
    constexpr int kPair = 1 << 10;
    return kPair + agreement(reference_[rows_[r]], candidate_[columns_[c]]) + best(r + 1, c + 1);
  }

  std::span<const GridTraits> reference_, candidate_;
  const Places &rows_, &columns_;
  std::vector<int> best_;  ///< the best sum of the grids from a row and a column on
};

std::map<std::string, std::vector<std::size_t>> placesByName(std::span<const GridTraits> grids) {
  std::map<std::string, std::vector<std::size_t>> places;
  for (std::size_t g = 0; g < grids.size(); ++g) places[grids[g].name].push_back(g);
  return places;
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

std::string shownText(std::string_view text, LineEnds lineEnds) {
  std::string shown;
  while (!text.empty()) {
    const std::size_t length = characterAt(text);
    const std::uint32_t point = length == 0 ? 0 : codePointOf(text.substr(0, length));
    const bool isKept = point == '\n' && lineEnds == LineEnds::kKeep;
    const bool isShown = isKept || (length > 0 && !isControl(point) && !movesText(point));
    shown += isShown ? text.substr(0, length) : std::string_view("?");
    text.remove_prefix(std::max<std::size_t>(length, 1));
  }
  return shown;
}

std::string shownName(std::string_view name) {
  return name.empty() ? kUnnamed : shownText(name, LineEnds::kReplace);
}

GridNames::GridNames(std::vector<std::string> names) : names_(std::move(names)) {
  for (std::size_t g = 0; g < names_.size(); ++g) {
    Places& places = places_[names_[g]];
    number_.push_back(places.size());
    places.push_back(g);
  }
  nameUniquely();
}

void GridNames::nameUniquely() {
  unique_.resize(names_.size());
  // A name that is no longer itself when it is shown counts as one that is shared.
  const auto isOwn = [&](std::size_t g) {
    return withName(names_[g])->size() == 1 && baseOf(g) == names_[g];
  };
  for (std::size_t g = 0; g < names_.size(); ++g)
    if (isOwn(g)) byUnique_[unique_[g] = names_[g]] = g;
  for (std::size_t g = 0; g < names_.size(); ++g) {
    if (isOwn(g)) continue;
    std::string name = baseOf(g);
    const bool isAlone = withName(names_[g])->size() == 1;
    if (!isAlone || isTaken(name)) name += '[' + std::to_string(number_[g]) + ']';
    if (isTaken(name)) name = baseOf(g);
    while (isTaken(name) || (!isAlone && name == baseOf(g))) name += '#' + std::to_string(g + 1);
    byUnique_[unique_[g] = name] = g;
  }
}

std::string GridNames::baseOf(std::size_t place) const { return shownName(names_[place]); }

bool GridNames::isTaken(const std::string& name) const {
  return places_.contains(name) || byUnique_.contains(name);
}

std::string GridNames::ofComponent(std::size_t place, std::size_t component) const {
  const std::string axis{'.', kComponentLetters.at(component)};
  std::string name = unique_.at(place);
  if (!isTaken(name + axis)) return name + axis;
  name = baseOf(place) + '[' + std::to_string(number_[place]) + ']';
  if (wholeGrid(name) == place && !isTaken(name + axis)) return name + axis;
  name = baseOf(place);
  do name += '#' + std::to_string(place + 1);
  while (wholeGrid(name) != place || isTaken(name + axis));
  return name + axis;
}

const GridNames::Places* GridNames::withName(const std::string& name) const {
  const auto at = places_.find(name);
  if (at != places_.end()) return &at->second;
  return name == kUnnamed && places_.contains("") ? &places_.at("") : nullptr;
}

/// The grid of "NAME[i]".
std::optional<std::size_t> GridNames::numbered(const std::string& wanted) const {
  const std::size_t open = wanted.rfind('[');
  if (open == std::string::npos || wanted.back() != ']') return std::nullopt;
  const auto number =
      wholeNumber(std::string_view(wanted).substr(open + 1, wanted.size() - open - 2));
  const Places* places = withName(wanted.substr(0, open));
  if (!number || !places || *number >= places->size()) return std::nullopt;
  return (*places)[*number];
}

/// The grid of "NAME#n".
std::optional<std::size_t> GridNames::placed(const std::string& wanted) const {
  std::string name = wanted;
  std::optional<std::size_t> number;
  // A unique name may repeat the number, so that it differs from the names of other grids.
  for (std::size_t mark = name.rfind('#'); mark != std::string::npos; mark = name.rfind('#')) {
    const auto given = wholeNumber(std::string_view(name).substr(mark + 1));
    if (!given || *given == 0 || *given > names_.size() || (number && number != given))
      return std::nullopt;
    number = given;
    name.resize(mark);
    if (name == names_[*number - 1] || name == baseOf(*number - 1)) return *number - 1;
  }
  return std::nullopt;
}

std::optional<std::size_t> GridNames::wholeGrid(const std::string& wanted) const {
  if (const auto same = places_.find(wanted); same != places_.end())
    return same->second.size() == 1 ? std::optional(same->second.front()) : std::nullopt;
  if (const auto own = byUnique_.find(wanted); own != byUnique_.end()) return own->second;
  if (const Places* places = withName(wanted); places && places->size() == 1)
    return places->front();
  const auto number = numbered(wanted);
  return number ? number : placed(wanted);
}

std::optional<NamedGrid> GridNames::lookUp(const std::string& wanted) const {
  if (const auto place = wholeGrid(wanted)) return NamedGrid{*place};
  if (places_.contains(wanted) || wanted.size() < 2 || wanted[wanted.size() - 2] != '.')
    return std::nullopt;
  const std::size_t axis = kComponentLetters.find(wanted.back());
  const auto place = wholeGrid(wanted.substr(0, wanted.size() - 2));
  if (axis == std::string_view::npos || !place) return std::nullopt;
  return NamedGrid{*place, axis};
}

bool GridNames::isAmbiguous(const std::string& wanted) const {
  return withName(wanted) && !lookUp(wanted);
}

std::string GridNames::list() const { return quotedList(unique_); }

void GridNames::refuse(const std::string& wanted, const std::filesystem::path& file) const {
  const Places* places = withName(wanted);
  if (!places)
    throw BadInput(prefixOf(file) + "has no grid \"" + shownText(wanted, LineEnds::kReplace) +
                   "\"; there are: " + quotedList(unique_) + didYouMean(wanted, unique_, "\""));
  std::string candidates;
  for (std::size_t n = 0; n < std::min(places->size(), kMostListed); ++n)
    candidates += (n == 0 ? "\"" : ", \"") + unique_[(*places)[n]] + "\" (grid " +
                  std::to_string((*places)[n] + 1) + " of the file)";
  if (places->size() > kMostListed)
    candidates += " and " + std::to_string(places->size() - kMostListed) + " more";
  throw BadInput(prefixOf(file) + "has " + std::to_string(places->size()) + " grids \"" +
                 shownName(wanted) + "\"; name one of them: " + candidates);
}

NamedGrid GridNames::find(const std::string& wanted, const std::filesystem::path& file) const {
  const auto found = lookUp(wanted);
  if (!found) refuse(wanted, file);
  return *found;
}

std::size_t GridNames::findWhole(const std::string& wanted,
                                 const std::filesystem::path& file) const {
  const auto place = wholeGrid(wanted);
  if (!place) refuse(wanted, file);
  return *place;
}

std::vector<std::optional<std::size_t>> pairGrids(std::span<const GridTraits> reference,
                                                  std::span<const GridTraits> candidate) {
  std::vector<std::optional<std::size_t>> pairs(reference.size());
  const auto candidates = placesByName(candidate);
  for (const auto& [name, places] : placesByName(reference))
    if (const auto same = candidates.find(name); same != candidates.end())
      Alignment(reference, places, candidate, same->second).pair(pairs);
  return pairs;
}

// ---- Inactive values

namespace {

/// The mixing function of SplitMix64 (Steele, Lea and Flood 2014), made odd, so that no factor of a
/// product makes it 0.
constexpr std::uint64_t mixed(std::uint64_t n) {
  n += 0x9e3779b97f4a7c15u;
  n = (n ^ (n >> 30)) * 0xbf58476d1ce4e5b9u;
  n = (n ^ (n >> 27)) * 0x94d049bb133111ebu;
  return (n ^ (n >> 31)) | 1u;
}

/// The hash of a coordinate is the product of a hash of its block of 128 and of one of its place in
/// the block, so that a tile of 4096 takes 32 steps.
constexpr int kBlockLog2 = 7;
constexpr std::int64_t kEmptyBlockSide = std::int64_t{1} << kBlockLog2;

constexpr std::uint64_t hashInBlock(std::int64_t place, std::uint64_t axis) {
  return mixed((std::uint64_t{1} << 48) + (axis << 32) + std::uint64_t(place));
}
constexpr std::uint64_t sumOfBlock(std::uint64_t axis) {
  std::uint64_t sum = 0;
  for (std::int64_t place = 0; place < kEmptyBlockSide; ++place) sum += hashInBlock(place, axis);
  return sum;
}
/// By axis, from 1.
constexpr std::uint64_t kSumsOfBlock[] = {0, sumOfBlock(1), sumOfBlock(2), sumOfBlock(3)};

/// The sum of the hashes of the coordinates of a side of a box.
std::uint64_t hashesAlong(std::int32_t from, std::int32_t to, std::uint64_t axis) {
  std::uint64_t sum = 0;
  for (std::int64_t c = from; c <= to;) {
    const std::int64_t place = c & (kEmptyBlockSide - 1),
                       end = std::min(c - place + kEmptyBlockSide, to + std::int64_t{1});
    std::uint64_t places = kSumsOfBlock[axis];
    if (end - c < kEmptyBlockSide) {
      places = 0;
      for (std::int64_t i = 0; i < end - c; ++i) places += hashInBlock(place + i, axis);
    }
    sum += mixed((axis << 32) | std::uint32_t(c >> kBlockLog2)) * places;
    c = end;
  }
  return sum;
}

std::uint64_t hashOf(double value) {
  return mixed(std::bit_cast<std::uint64_t>(value == 0.0 ? 0.0 : value));
}

}  // namespace

void InactiveValues::add(double value, const Box& tile) {
  const bool isFirst = count_ == 0, isFirstFinite = count_ == nonFinite_;
  const auto voxels = std::uint64_t(tile.volume());
  count_ += voxels;
  if (isFirst) first_ = tile.min;
  if (!std::isfinite(value)) {
    nonFinite_ += voxels;
  } else {
    min_ = isFirstFinite ? value : std::min(min_, value);
    max_ = isFirstFinite ? value : std::max(max_, value);
  }
  digest_ += hashOf(value) * hashesAlong(tile.min.x, tile.max.x, 1) *
             hashesAlong(tile.min.y, tile.max.y, 2) * hashesAlong(tile.min.z, tile.max.z, 3);
}

void InactiveValues::add(const InactiveValues& others) {
  if (others.count_ == 0) return;
  if (count_ == 0) first_ = others.first_;
  if (others.count_ > others.nonFinite_) {
    const bool hasFinite = count_ > nonFinite_;
    min_ = hasFinite ? std::min(min_, others.min_) : others.min_;
    max_ = hasFinite ? std::max(max_, others.max_) : others.max_;
  }
  count_ += others.count_;
  nonFinite_ += others.nonFinite_;
  digest_ += others.digest_;
}

InactiveValues InactiveValues::ofComponent(std::size_t component) const {
  InactiveValues values = *this;
  values.digest_ *= mixed(component);
  return values;
}

void Narrowing::addError(double value, double error, Coord at) {
  errors.add(error, at);
  squares += error * error;
  relative = std::max(relative, std::abs(error) / std::max(std::abs(value), kLeastNormalFloat));
}

Narrowing between(const Narrowing& a, const Narrowing& b) {
  if (a.errors == b.errors) return {};
  Narrowing sum = a;
  sum.errors.add(a.largest() + b.largest(), b.errors.first());
  // The root of the sum is at most the sum of the roots.
  const double root = std::sqrt(a.squares) + std::sqrt(b.squares);
  sum.squares = root * root;
  sum.relative += b.relative;
  return sum;
}

VectorNarrowing between(const VectorNarrowing& a, const VectorNarrowing& b) {
  return {between(a[0], b[0]), between(a[1], b[1]), between(a[2], b[2])};
}

std::string toText(const InactiveValues& values) {
  std::string text = std::to_string(values.count()) +
                     (values.count() == 1 ? " inactive value (" : " inactive values (");
  const std::uint64_t finite = values.count() - values.nonFinite();
  if (finite > 0) text += shortText(values.min());
  if (finite > 0 && values.max() != values.min()) text += " to " + shortText(values.max());
  if (values.nonFinite() > 0)
    text += (finite > 0 ? ", and " : "") + std::to_string(values.nonFinite()) + " NaN or infinite";
  return text + ", first at " + toString(values.first()) + ')';
}

}  // namespace esvr
