#include "generators/tubes.h"

#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <numeric>
#include <string_view>
#include <unordered_map>

#include "esvr/error.h"
#include "generators/shapes.h"

namespace esvr::samples {

// The shape of tubes.

namespace {

double distanceToBall(Vec3 center, double radius, Vec3 p) { return length(p - center) - radius; }

Vec3 outerCorner(const Tube& tube, double reach, double sign) {
  const auto corner = [&](Vec3 center, double radius) {
    const double r = sign * (radius + reach);
    return center + Vec3{r, r, r};
  };
  const Vec3 a = corner(tube.a, tube.radiusA), b = corner(tube.b, tube.radiusB);
  return sign < 0.0 ? minVec(a, b) : maxVec(a, b);
}

Coord floorCoord(Vec3 v) {
  return {std::int32_t(std::floor(v.x)), std::int32_t(std::floor(v.y)),
          std::int32_t(std::floor(v.z))};
}

}  // namespace

double signedDistance(const Tube& tube, Vec3 p) {
  const Vec3 axis = tube.b - tube.a;
  const double span = length(axis);
  // the radius shrinks by `slope` for each unit of length; if it changes faster than the centre
  // moves, the larger ball contains the smaller one
  const double shrink = tube.radiusA - tube.radiusB;
  if (std::abs(shrink) >= span)
    return shrink > 0.0 ? distanceToBall(tube.a, tube.radiusA, p)
                        : distanceToBall(tube.b, tube.radiusB, p);
  const double slope = shrink / span;
  const Vec3 direction = axis * (1.0 / span), relative = p - tube.a;
  const double along = dot(relative, direction);
  const double across = length(relative - direction * along);
  // the ball with the nearest surface: the minimum over t of |p - c(t)| - r(t)
  const double nearest = along - slope * across / std::sqrt(1.0 - slope * slope);
  const double t = std::clamp(nearest, 0.0, span);
  return distanceToBall(tube.a + direction * t, tube.radiusA - slope * t, p);
}

TubeShape::TubeShape(std::span<const Tube> tubes, double edge)
    : tubes_(tubes), edge_(edge), near_(tubes.size()) {
  std::iota(near_.begin(), near_.end(), 0u);
}

std::optional<TubeShape> TubeShape::within(const Ball& ball) const {
  std::vector<double> distances(near_.size());
  std::transform(near_.begin(), near_.end(), distances.begin(),
                 [&](std::uint32_t i) { return signedDistance(tubes_[i], ball.center); });
  const double nearest = *std::min_element(distances.begin(), distances.end());
  // The slope of distances is at most 1. A tube further away than this is nowhere the nearest in
  // the ball, or its edge does not reach the ball.
  const double furthest = std::min(nearest + 2.0 * ball.radius, ball.radius + edge_ / 2.0);
  std::vector<std::uint32_t> near;
  for (std::size_t k = 0; k < near_.size(); ++k)
    if (distances[k] <= furthest) near.push_back(near_[k]);
  if (near.empty()) return std::nullopt;
  near.shrink_to_fit();
  return TubeShape(tubes_, edge_, std::move(near));
}

Sample TubeShape::at(Vec3 p) const {
  double distance = std::numeric_limits<double>::infinity();
  for (const std::uint32_t i : near_) distance = std::min(distance, signedDistance(tubes_[i], p));
  const float value = softEdge(distance, edge_);
  return {value, value > 0.0f};
}

Box boundsOf(std::span<const Tube> tubes, double edge) {
  Vec3 low = tubes.front().a, high = low;
  for (const Tube& tube : tubes) {
    low = minVec(low, outerCorner(tube, edge / 2.0, -1.0));
    high = maxVec(high, outerCorner(tube, edge / 2.0, 1.0));
  }
  return {floorCoord(low), floorCoord(high) + Coord{1, 1, 1}};
}

SparseVolume voxeliseTubes(std::span<const Tube> tubes, double edge, const Limits& limits) {
  return voxelise(TubeShape(tubes, edge),
                  {.box = boundsOf(tubes, edge), .background = 0.0f, .limits = limits});
}

// Scales.

namespace {

struct Extent {
  Vec3 low, high;
};

Vec3 cube(double half) { return {half, half, half}; }

Extent extentOf(std::span<const Tube> tubes) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Extent extent{cube(kInfinity), cube(-kInfinity)};
  const auto include = [&](Vec3 center, double radius) {
    extent.low = minVec(extent.low, center - cube(radius));
    extent.high = maxVec(extent.high, center + cube(radius));
  };
  for (const Tube& tube : tubes) {
    include(tube.a, tube.radiusA);
    include(tube.b, tube.radiusB);
  }
  return extent;
}

}  // namespace

ScaledTubes fitTubes(std::span<const Tube> tubes, const TubeScale& scale) {
  const Extent extent = extentOf(tubes);
  const Vec3 size = extent.high - extent.low;
  const double longest = std::max({size.x, size.y, size.z});
  if (!(longest > 0.0) || !std::isfinite(longest)) throw BadInput("the tubes have no extent");

  ScaledTubes scaled;
  scaled.voxelSize = longest / scale.resolution;
  scaled.origin = extent.low + cube((0.5 - scale.margin) * scaled.voxelSize);
  const auto place = [&](Vec3 p) { return (p - scaled.origin) * (1.0 / scaled.voxelSize); };
  const auto radius = [&](double r) { return std::max(r / scaled.voxelSize, scale.minRadius); };
  for (const Tube& tube : tubes)
    scaled.tubes.push_back(
        {place(tube.a), place(tube.b), radius(tube.radiusA), radius(tube.radiusB)});
  return scaled;
}

// Branching vessels.

namespace {

constexpr double kTrunkRadius = 1.0;
constexpr double kTwigRadius = 0.09;  // radius below which branches do not fork
constexpr int kTubesPerBranch = 6;
constexpr double kTubeLength = 2.9;  // length of a tube in radii of the branch
constexpr double kMeander = 0.32;    // random share of each step's direction
constexpr double kTaper = 0.98;      // factor of the radius for each step
constexpr double kSpread = 0.45;     // sideways share of a fork's directions

/// Radii of a fork's two branches relative to their parent's. By Murray's law the sum of their
/// cubes is 1.
constexpr std::array<std::array<double, 2>, 3> kForks{
    {{0.794, 0.794}, {0.870, 0.699}, {0.930, 0.580}}};

struct Branch {
  Vec3 start, direction;
  double radius;
};

/// Adds the tubes of a branch. \return the end of the branch
Branch grow(Branch at, Random& random, std::vector<Tube>& tubes) {
  for (int i = 0; i < kTubesPerBranch; ++i) {
    at.direction = normalised(at.direction + random.direction() * kMeander);
    const Vec3 end = at.start + at.direction * (at.radius * kTubeLength * random.uniform(0.7, 1.3));
    tubes.push_back({at.start, end, at.radius, at.radius * kTaper});
    at.start = end;
    at.radius *= kTaper;
  }
  return at;
}

Vec3 sidewaysFrom(Vec3 direction, Random& random) {
  const Vec3 any = random.direction();
  return normalised(any - direction * dot(any, direction) + Vec3{1e-9, 0.0, 0.0});
}

std::array<Branch, 2> fork(const Branch& end, Random& random) {
  const auto& radii = kForks[std::size_t(random.uniform() * kForks.size())];
  const Vec3 sideways = sidewaysFrom(end.direction, random);
  const auto branch = [&](double ratio, double side) {
    // the thinner branch turns away more
    const Vec3 turned = end.direction + sideways * (side * kSpread / ratio);
    return Branch{end.start, normalised(turned), end.radius * ratio};
  };
  return {branch(radii[0], 1.0), branch(radii[1], -1.0)};
}

std::vector<Tube> growTree(std::uint64_t seed) {
  Random random(seed);
  std::vector<Tube> tubes;
  std::vector<Branch> open{{{}, {0.0, 1.0, 0.0}, kTrunkRadius}};
  while (!open.empty()) {
    const Branch end = grow(open.back(), random, tubes);
    open.pop_back();
    if (end.radius < kTwigRadius) continue;
    for (const Branch& branch : fork(end, random)) open.push_back(branch);
  }
  return tubes;
}

}  // namespace

std::vector<Tube> treeTubes(const SampleOptions& options) {
  const auto tubes = growTree(options.seed);
  return fitTubes(tubes, {.resolution = options.resolution, .minRadius = kThinnestTube}).tubes;
}

SparseVolume makeTree(const SampleOptions& options) {
  return voxeliseTubes(treeTubes(options), kDefaultEdge, options.limits);
}

// ---- Skeletons

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
