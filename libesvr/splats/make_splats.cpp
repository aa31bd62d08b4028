// From ellipsoids to splats: the density of a grid becomes a sum of Gaussians whose amplitudes are above 0, and
// each Gaussian becomes a splat. docs/splats.md derives the mapping.

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "core/parallel.h"
#include "esvr/error.h"
#include "esvr/field.h"
#include "esvr/grid_coding.h"
#include "esvr/metrics.h"
#include "esvr/splats.h"
#include "field/evaluate.h"
#include "field/voxel_rule.h"
#include "splats/gaussian.h"

namespace esvr::splats {
namespace {

constexpr double kPi = std::numbers::pi;

Quaternion asQuaternion(const Eigen::Quaterniond& q) {
  const double sign = q.w() < 0.0 ? -1.0 : 1.0;
  return {sign * q.w(), sign * q.x(), sign * q.y(), sign * q.z()};
}

Eigen::Matrix3d asEigen(const Matrix3& m) {
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(m.data());
}

}  // namespace

KernelGaussian gaussianOf(const Kernel& kernel, double kappa) {
  constexpr int kIntervals = 512;  // of Simpson's rule; the kernel is smooth up to its end
  const auto c = kernelConstants<double>(kernel, kappa);
  const double step = supportRadius(c) / kIntervals;
  double second = 0.0, fourth = 0.0;
  for (int i = 1; i < kIntervals; ++i) {
    const double r = i * step, weight = i % 2 == 1 ? 4.0 : 2.0;
    const double phi = weight * kernelPhi(c, r * r);
    second += phi * r * r;
    fourth += phi * r * r * r * r;
  }
  return {std::sqrt(fourth / second / 3.0), 4.0 * kPi * second * step / 3.0};
}

Kernel gaussianKernel() {
  constexpr float kAlmostMinusInfinity = -1e4f, kCut = 1e-4f;
  return {KernelForm::kContinuous, kAlmostMinusInfinity, kCut};
}

double gaussianVolume() {
  const double cut = double(gaussianKernel().epsilon), radius = std::sqrt(-std::log(cut));
  const double whole = std::pow(kPi, 1.5) * std::erf(radius) - 2.0 * kPi * radius * cut;
  const double base = 4.0 / 3.0 * kPi * radius * radius * radius * cut;
  return 2.0 * std::numbers::sqrt2 * (whole - base) / (1.0 - cut);
}

double meanShadow(Sizes halfAxes) {
  constexpr double kRound = 1e-4;  // below this, the difference of the axes would cancel
  std::sort(halfAxes.begin(), halfAxes.end(), std::greater<>());
  const auto [a, b, c] = halfAxes;
  if (a - c < kRound * a) return (a * b + a * c + b * c) / 3.0;
  const double cosine = c / a, sine = std::sqrt((1.0 - cosine) * (1.0 + cosine));
  const double k = std::min(1.0, a / b * std::sqrt((b - c) * (b + c) / ((a - c) * (a + c))));
  const double angle = std::acos(cosine);
  const double mixed = std::ellint_2(k, angle) * sine * sine +
                       (c > 0.0 ? std::ellint_1(k, angle) * cosine * cosine : 0.0);
  return (c * c + a * b / sine * mixed) / 2.0;
}

double depthOfAlpha(double alpha) {
  constexpr double kHalf = 0.5, kEnough = 1e-17;
  if (alpha > kHalf) {
    const double rest = 1.0 - alpha;
    const double logs = rest > 0.0 ? std::log(alpha) * std::log(rest) : 0.0;
    return kPi * kPi / 6.0 - logs - depthOfAlpha(rest);
  }
  double sum = 0.0, power = alpha;
  for (double n = 1.0; power > kEnough * alpha; ++n, power *= alpha) sum += power / (n * n);
  return sum;
}

double widening(double depth, double alpha) { return std::sqrt(depth / depthOfAlpha(alpha)); }

Quaternion quaternionOf(const Matrix3& rotation) {
  return asQuaternion(Eigen::Quaterniond(asEigen(rotation)));
}

Quaternion product(const Quaternion& a, const Quaternion& b) {
  return asQuaternion(Eigen::Quaterniond(a[0], a[1], a[2], a[3]) *
                      Eigen::Quaterniond(b[0], b[1], b[2], b[3]));
}

PrincipalGaussian principalAxesOf(const Matrix3& columns) {
  // The squares lose half of the digits of float64, which leaves enough for sizes down to a millionth.
  const Eigen::Matrix3d m = asEigen(columns);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(m * m.transpose());
  Eigen::Matrix3d axes = solver.eigenvectors().rowwise().reverse();
  if (axes.determinant() < 0.0) axes.col(2) = -axes.col(2);
  const Eigen::Vector3d squares = solver.eigenvalues().cwiseMax(0.0);
  return {asQuaternion(Eigen::Quaterniond(axes)),
          {std::sqrt(squares[2]), std::sqrt(squares[1]), std::sqrt(squares[0])}};
}

}  // namespace esvr::splats

// ---- Splats of a grid

namespace esvr {

void Splats::resize(std::size_t n, bool withColors) {
  for (auto& v : center) v.resize(n);
  for (auto& v : logScale) v.resize(n);
  for (auto& v : rotation) v.resize(n);
  for (auto& v : color) v.resize(withColors ? n : 0);
  alpha.resize(n);
}

namespace splats {
namespace {

// What can be exported.

[[noreturn]] void refuse(const StoredGrid& grid, const std::string& why) {
  throw CannotConvert("grid \"" + shownName(grid.descriptor.name) +
                      "\" cannot become splats: " + why);
}

void requireEllipsoids(const StoredGrid& grid) {
  if (grid.descriptor.gridClass == GridClass::kLevelSet)
    refuse(grid,
           "it is a level set, which has no density; OpenVDB's sdfToFogVolume makes one of it");
  if (grid.voxels || grid.residual)
    refuse(grid, "it holds voxels; vdb2esvr --representation ellipsoids stores ellipsoids");
  if (grid.descriptor.background != 0.0 || grid.field.background != 0.0f)
    refuse(grid, "its background is " + std::to_string(grid.descriptor.background) +
                     ", and splats leave space empty; subtract the background first");
  if (grid.field.ellipsoidCount() == 0) refuse(grid, "it has no ellipsoids");
  if (grid.activeBox.empty()) refuse(grid, "no voxel of it is active");
  if (!grid.descriptor.transform.affine)
    refuse(grid, "its transform is a frustum, in which ellipsoids have no shape of their own");
}

/// Ellipsoids of a damaged or hostile file may reach more bricks than can be listed.
void requireListable(const StoredGrid& grid, std::uint64_t maxBytes) {
  constexpr double kBytesPerBrick = 2.0 * sizeof(Coord);  // the list grows; voxels are not kept
  WorkEstimate work = estimateDecode(grid, {.maxBytes = maxBytes});
  const double bricks = std::exchange(work.bricks, 0.0);
  requireWithinMemory(work.bytes() + bricks * kBytesPerBrick, maxBytes,
                      "the splats of grid \"" + shownName(grid.descriptor.name) + "\"");
}

// The Gaussians of a density, in index space.

/// The ellipsoids of a positive intensity, since no splat takes away from others.
Field positiveOf(const Field& field) {
  Field positive;
  positive.kernel = field.kernel;
  for (const Chunk& chunk : field.chunks) {
    const Ellipsoids& from = chunk.ellipsoids;
    Chunk made{chunk.origin, {}};
    Ellipsoids& to = made.ellipsoids;
    for (std::size_t i = 0; i < from.size(); ++i) {
      if (!(from.intensity[i] > 0.0f)) continue;
      for (std::size_t a = 0; a < 3; ++a) {
        to.center[a].push_back(from.center[a][i]);
        to.logScale[a].push_back(from.logScale[a][i]);
      }
      for (std::size_t a = 0; a < 4; ++a) to.rotation[a].push_back(from.rotation[a][i]);
      to.intensity.push_back(from.intensity[i]);
      if (!from.kappa.empty()) to.kappa.push_back(from.kappa[i]);
    }
    positive.chunks.push_back(std::move(made));
  }
  return positive;
}

/// Makes ellipsoids Gaussians with their integrals and second moments.
void becomeGaussians(Field& field) {
  const double ofGaussian = gaussianVolume();
  const KernelGaussian common = gaussianOf(field.kernel, double(field.kernel.kappa));
  for (Chunk& chunk : field.chunks) {
    Ellipsoids& e = chunk.ellipsoids;
    for (std::size_t i = 0; i < e.size(); ++i) {
      const auto [width, volume] =
          e.kappa.empty() ? common : gaussianOf(field.kernel, double(e.kappa[i]));
      // exp(-m) has a standard deviation of 1 / sqrt(2).
      const double wider = std::log(width * std::numbers::sqrt2);
      for (auto& scale : e.logScale) scale[i] = float(double(scale[i]) + wider);
      e.intensity[i] =
          float(double(e.intensity[i]) * volume / (ofGaussian * width * width * width));
    }
    e.kappa.clear();
  }
  field.kernel = gaussianKernel();
}

/// The integral of a sum of Gaussians of becomeGaussians().
double integralOf(const Field& gaussians) {
  double integral = 0.0;
  for (const Chunk& chunk : gaussians.chunks) {
    const Ellipsoids& e = chunk.ellipsoids;
    for (std::size_t i = 0; i < e.size(); ++i)
      integral +=
          double(e.intensity[i]) *
          std::exp(double(e.logScale[0][i]) + double(e.logScale[1][i]) + double(e.logScale[2][i]));
  }
  return integral * gaussianVolume() / (2.0 * std::numbers::sqrt2);
}

/// One ellipsoid of a field in float64. The columns are the standard deviations of a Gaussian, and about those
/// of other kernels.
struct Gaussian {
  std::array<double, 3> center;
  Matrix3 columns;  ///< the axes times the standard deviations

  Gaussian(const Chunk& chunk, std::size_t i) {
    const Ellipsoids& e = chunk.ellipsoids;
    const Coord o = chunk.origin;
    center = {double(o.x) + e.center[0][i], double(o.y) + e.center[1][i],
              double(o.z) + e.center[2][i]};
    columns = rotationOf(
        normalised({e.rotation[0][i], e.rotation[1][i], e.rotation[2][i], e.rotation[3][i]}));
    for (int c = 0; c < 3; ++c) {
      const double size = std::exp(double(e.logScale[c][i])) / std::numbers::sqrt2;
      for (int r = 0; r < 3; ++r) columns[3 * r + c] *= size;
    }
  }
};

/// Places at which an ellipsoid is compared with the density, with weights whose sums are means over a Gaussian:
/// Gauss-Hermite quadrature with three places along each axis.
constexpr std::size_t kSamples = 27;
constexpr double kSampleAt[] = {-1.7320508075688772, 0.0, 1.7320508075688772};
constexpr float kSampleWeight[] = {1.0f / 6.0f, 2.0f / 3.0f, 1.0f / 6.0f};

void addSamples(const Gaussian& g, std::vector<Place>& places) {
  constexpr double kFarthest = 0x1p30;  // the index space is larger
  for (const double x : kSampleAt)
    for (const double y : kSampleAt)
      for (const double z : kSampleAt) {
        Place place;
        for (int r = 0; r < 3; ++r) {
          const double* row = &g.columns[3 * r];
          place[r] =
              std::clamp(g.center[r] + x * row[0] + y * row[1] + z * row[2], -kFarthest, kFarthest);
        }
        places.push_back(place);
      }
}

float weightOf(std::size_t sample) {
  return kSampleWeight[sample / 9] * kSampleWeight[sample / 3 % 3] * kSampleWeight[sample % 3];
}

/// The density that a grid's sum stands for at a place: its value by the rule of its nearest voxel, at least 0.
class Density {
 public:
  explicit Density(const StoredGrid& grid)
      : options_(voxelRule(grid)), rule_(makeVoxelRule(grid.field.background, options_)) {}

  [[nodiscard]] float operator()(const Place& place, float sum) const {
    const Coord voxel{std::int32_t(std::floor(place[0] + 0.5)),
                      std::int32_t(std::floor(place[1] + 0.5)),
                      std::int32_t(std::floor(place[2] + 0.5))};
    if (!options_.box.contains(voxel) || !isInBricks(voxel)) return 0.0f;
    return std::max(options_.masks.empty() ? rule_(sum) : rule_.settled(sum), 0.0f);
  }

 private:
  [[nodiscard]] bool isInBricks(Coord voxel) const {
    if (!options_.restrictToBricks) return true;
    const Coord corner = brickOf(voxel) * kBrickSide;
    const auto at = std::lower_bound(options_.bricks.begin(), options_.bricks.end(), corner);
    if (at == options_.bricks.end() || *at != corner) return false;
    return options_.masks.empty() || options_.masks[std::size_t(at - options_.bricks.begin())].test(
                                         voxelOffset(localOf(voxel)));
  }

  RevoxeliseOptions options_;
  VoxelRule rule_;
};

/// The sum of the density over all voxels, which is its integral in index space.
double integralOf(const StoredGrid& grid, const Density& density) {
  const std::vector<Coord> corners = reachedBricks(grid.field, grid.activeBox);
  double integral = 0.0;
  forEachBatch(grid.field, corners, [&](const BrickBatch& batch) {
    std::vector<double> sums(batch.size());
    parallelFor(std::size_t{0}, batch.size(), [&](std::size_t b) {
      const auto values = batch.values(b);
      for (int v = 0; v < kBrickVoxels; ++v) {
        const Coord voxel = batch.corners[b] + voxelLocal(v);
        sums[b] += double(density({double(voxel.x), double(voxel.y), double(voxel.z)}, values[v]));
      }
    });
    for (const double sum : sums) integral += sum;
  });
  return integral;
}

/// Ellipsoids of a chunk that are treated together, so that their places take little memory.
struct Block {
  std::size_t chunk, begin, end;
};

std::vector<Block> blocksOf(const Field& field) {
  constexpr std::size_t kBlock = std::size_t{1} << 16;
  std::vector<Block> blocks;
  for (std::size_t c = 0; c < field.chunks.size(); ++c) {
    const std::size_t n = field.chunks[c].ellipsoids.size();
    for (std::size_t begin = 0; begin < n; begin += kBlock)
      blocks.push_back({c, begin, std::min(n, begin + kBlock)});
  }
  return blocks;
}

/// Fits the amplitudes of positive ellipsoids to the density of a grid. They are as they should be unless the grid
/// has negative ellipsoids, a clamp, a tone curve, or voxels that are not active.
class AmplitudeFit {
 public:
  AmplitudeFit(const StoredGrid& grid, Field& positive)
      : positive_(positive), blocks_(blocksOf(positive)) {
    const Density density(grid);
    for (const Block& block : blocks_) {
      const std::vector<Place> places = placesOf(block);
      std::vector<float> sums(places.size());
      evaluatePlaces(grid.field, places, sums);
      parallelFor(std::size_t{0}, sums.size(),
                  [&](std::size_t p) { sums[p] = density(places[p], sums[p]); });
      densities_.push_back(std::move(sums));
    }
  }

  /// Multiplies each amplitude by the mean ratio of the density to the sum. This is a step of the Richardson-Lucy
  /// method, which keeps amplitudes above 0.
  void improve() {
    std::vector<std::vector<float>> ratios;
    for (std::size_t b = 0; b < blocks_.size(); ++b) ratios.push_back(ratiosOf(b));
    for (std::size_t b = 0; b < blocks_.size(); ++b) {
      auto& amplitudes = positive_.chunks[blocks_[b].chunk].ellipsoids.intensity;
      for (std::size_t i = 0; i < ratios[b].size(); ++i)
        amplitudes[blocks_[b].begin + i] *= ratios[b][i];
    }
  }

  /// The densities at the places of each Gaussian, in the order of the Gaussians.
  [[nodiscard]] std::vector<float> densities() const {
    std::vector<float> all;
    for (const auto& block : densities_) all.insert(all.end(), block.begin(), block.end());
    return all;
  }

 private:
  [[nodiscard]] std::vector<Place> placesOf(const Block& block) const {
    std::vector<Place> places;
    places.reserve((block.end - block.begin) * kSamples);
    for (std::size_t i = block.begin; i < block.end; ++i)
      addSamples(Gaussian(positive_.chunks[block.chunk], i), places);
    return places;
  }

  [[nodiscard]] std::vector<float> ratiosOf(std::size_t b) const {
    const std::vector<Place> places = placesOf(blocks_[b]);
    std::vector<float> sums(places.size());
    evaluatePlaces(positive_, places, sums);
    std::vector<float> ratios(places.size() / kSamples);
    parallelFor(std::size_t{0}, ratios.size(), [&](std::size_t i) {
      float sum = 0.0f;
      for (std::size_t s = 0, p = i * kSamples; s < kSamples; ++s, ++p)
        if (sums[p] > 0.0f) sum += weightOf(s) * densities_[b][p] / sums[p];
      ratios[i] = sum;
    });
    return ratios;
  }

  Field& positive_;
  std::vector<Block> blocks_;
  std::vector<std::vector<float>> densities_;  ///< by block
};

// The space of a file.

/// The map from index space to the space of a file, and from there to the world.
struct FileSpace {
  Matrix3 linear{};  ///< of columns: file = linear index + shift
  std::array<double, 3> shift{};
  double perWorld = 1.0;  ///< length in the file of one unit of the world
  std::array<double, 16> toWorld{};
};

/// The axes of the world in those of the file, as rows.
Matrix3 turnOf(const SplatOptions& options) {
  if (options.form != SplatForm::kPly || !options.up) return {1, 0, 0, 0, 1, 0, 0, 0, 1};
  if (options.up == UpAxis::kZ) return {1, 0, 0, 0, 0, -1, 0, 1, 0};
  return {1, 0, 0, 0, -1, 0, 0, 0, -1};
}

struct WorldBox {
  std::array<double, 3> low, high;
  [[nodiscard]] double longest() const {
    return std::max({high[0] - low[0], high[1] - low[1], high[2] - low[2]});
  }
};

WorldBox worldBox(const Box& box, const std::array<double, 16>& affine) {
  WorldBox world{{1e300, 1e300, 1e300}, {-1e300, -1e300, -1e300}};
  for (int corner = 0; corner < 8; ++corner) {
    const double index[3] = {corner & 1 ? box.max.x + 0.5 : box.min.x - 0.5,
                             corner & 2 ? box.max.y + 0.5 : box.min.y - 0.5,
                             corner & 4 ? box.max.z + 0.5 : box.min.z - 0.5};
    for (int r = 0; r < 3; ++r) {
      double place = affine[12 + r];
      for (int c = 0; c < 3; ++c) place += index[c] * affine[4 * c + r];
      world.low[r] = std::min(world.low[r], place);
      world.high[r] = std::max(world.high[r], place);
    }
  }
  return world;
}

FileSpace fileSpaceOf(const StoredGrid& grid, const SplatOptions& options) {
  constexpr double kLongestSide = 10.0;  // .spz keeps places to 1/4096, and +-2048
  const auto& affine = *grid.descriptor.transform.affine;
  const WorldBox box = worldBox(grid.activeBox, affine);
  const Matrix3 turn = turnOf(options);
  FileSpace space;
  if (options.form == SplatForm::kPly) space.perWorld = kLongestSide / box.longest();
  std::array<double, 3> middle{};
  if (options.form != SplatForm::kMitsuba)
    for (int r = 0; r < 3; ++r) middle[r] = 0.5 * (box.low[r] + box.high[r]);
  for (int r = 0; r < 3; ++r) {
    space.shift[r] = 0.0;
    for (int c = 0; c < 3; ++c) {
      double entry = 0.0;
      for (int w = 0; w < 3; ++w) entry += turn[3 * r + w] * affine[4 * c + w];
      space.linear[3 * r + c] = entry * space.perWorld;
      space.shift[r] += turn[3 * r + c] * (affine[12 + c] - middle[c]) * space.perWorld;
      space.toWorld[4 * r + c] = turn[3 * r + c] / space.perWorld;
    }
    space.toWorld[12 + r] = middle[r];
  }
  space.toWorld[15] = 1.0;
  return space;
}

// From a Gaussian of the density to a splat.

/// An alpha that all formats keep, and at least one step of it.
struct AlphaLevel {
  static constexpr double kSteps = kAlphaSteps;
  double level;

  /// The nearest one.
  explicit AlphaLevel(double alpha) : level(std::max(std::round(alpha * kSteps), 1.0)) {}
  [[nodiscard]] double alpha() const { return level / kSteps; }
  /// A little more, for writers that cut what is below a level; float32 rounds by less.
  [[nodiscard]] double written() const { return (level + 0.002) / kSteps; }
};

/// The sizes that all formats keep, in units of a file of the form kPly.
constexpr double kSmallestSize = 0.0005, kLargestSize = 300.0;

/// A splat, or several ones at the same place.
struct Splat {
  std::array<double, 3> center;
  PrincipalGaussian shape;
  double alpha = 0.0;
  int copies = 0;         ///< 0: it is too faint for the formats
  double integral = 0.0;  ///< of its extinction over space
  bool isClamped = false;
};

/// A splat of a depth tau hides 1 - exp(-tau g) beside its center, where g is a Gaussian, but a reader draws
/// (1 - exp(-tau)) g, which is less. Several splats at one place, each with a part of the depth, are close to it.
constexpr double kDeepest = 1.0;
constexpr double kMostCopies = 16.0;  // a deeper splat lets nothing through

/// Sets the alpha and the size of a splat. \param depth  its optical depth through the center
void setAlpha(double depth, Splat& splat) {
  const double copies = std::clamp(std::ceil(depth / kDeepest), 1.0, kMostCopies);
  const double each = std::min(depth / copies, kDeepest), alpha = -std::expm1(-each);
  const AlphaLevel level(alpha);
  splat.alpha = level.written();
  splat.copies = alpha * AlphaLevel::kSteps < 0.5 ? 0 : int(copies);
  // The depth, summed over a picture, stays what it was.
  for (double& size : splat.shape.sizes) size *= widening(each, level.alpha());
}

Splat splatOf(const Gaussian& g, double amplitude, const FileSpace& space,
              const SplatOptions& options) {
  Splat splat{};
  Matrix3 columns{};
  for (int r = 0; r < 3; ++r) {
    splat.center[r] = space.shift[r];
    for (int k = 0; k < 3; ++k) {
      splat.center[r] += space.linear[3 * r + k] * g.center[k];
      for (int c = 0; c < 3; ++c)
        columns[3 * r + c] += space.linear[3 * r + k] * g.columns[3 * k + c];
    }
  }
  splat.shape = principalAxesOf(columns);
  Sizes& sizes = splat.shape.sizes;
  splat.integral = amplitude * gaussianVolume() * sizes[0] * sizes[1] * sizes[2];
  // Flat Gaussians get thicker, and keep their integral.
  for (double& size : sizes) size = std::max(size, sizes[0] / kMostFlat);
  setAlpha(splat.integral / (2.0 * std::numbers::pi * meanShadow(sizes)), splat);
  if (options.form == SplatForm::kPly)
    for (double& size : sizes) {
      const double kept = std::clamp(size, kSmallestSize, kLargestSize);
      splat.isClamped |= kept != size;
      size = kept;
    }
  return splat;
}

void append(const Splat& splat, const Rgb& color, Splats& to) {
  for (int a = 0; a < 3; ++a) {
    to.center[a].push_back(float(splat.center[a]));
    to.logScale[a].push_back(float(std::log(splat.shape.sizes[a])));
  }
  for (int a = 0; a < 4; ++a) to.rotation[a].push_back(float(splat.shape.rotation[a]));
  to.alpha.push_back(float(splat.alpha));
  to.color[0].push_back(float(color.r));
  to.color[1].push_back(float(color.g));
  to.color[2].push_back(float(color.b));
}

/// The mean color over densities, weighted by them.
Rgb meanColor(const ColorMap& colors, std::span<const float> densities) {
  Rgb sum;
  double weight = 0.0;
  for (std::size_t s = 0; s < kSamples; ++s) {
    const double v = double(densities[s]), share = v * double(weightOf(s));
    const Rgb color = colorAt(colors, v);
    sum.r += share * color.r, sum.g += share * color.g, sum.b += share * color.b;
    weight += share;
  }
  if (!(weight > 0.0)) return colorAt(colors, 0.0);
  return {sum.r / weight, sum.g / weight, sum.b / weight};
}

double densityScaleOf(const StoredGrid& grid, const SplatOptions& options) {
  if (options.densityScale) {
    if (!(*options.densityScale > 0.0 && std::isfinite(*options.densityScale)))
      throw UsageError("the density scale must be above 0");
    return *options.densityScale;
  }
  const auto& a = *grid.descriptor.transform.affine;
  const Matrix3 m{a[0], a[1], a[2], a[4], a[5], a[6], a[8], a[9], a[10]};
  const double volume =
      std::abs(m[0] * (m[4] * m[8] - m[5] * m[7]) - m[1] * (m[3] * m[8] - m[5] * m[6]) +
               m[2] * (m[3] * m[7] - m[4] * m[6]));
  const ValueRange range{grid.valueMin, grid.valueMax};
  if (const auto depth = medianDepth(grid.field, grid.activeBox, range, grid.tone))
    return std::numbers::ln2 / (*depth * std::cbrt(volume));
  if (!(grid.valueMax > 0.0f)) refuse(grid, "no value is above 0");
  return std::log(1000.0) / (double(grid.valueMax) * worldBox(grid.activeBox, a).longest());
}

}  // namespace
}  // namespace splats

MadeSplats makeSplats(const StoredGrid& grid, const SplatOptions& options) {
  using namespace splats;
  constexpr int kRounds = 4;  // six change pictures by less than 0.1 dB (docs/splats.md)
  constexpr std::size_t kBetweenChecks = 4096;
  checkTransferFunction({options.colors, {{0.0, 1.0}}});
  requireEllipsoids(grid);
  requireListable(grid, options.maxBytes);
  MadeSplats made;
  made.ellipsoids = grid.field.ellipsoidCount();
  SplatScene& scene = made.scene;
  scene.name = grid.descriptor.name;
  scene.up = options.up.value_or(UpAxis::kY);
  scene.densityScale = densityScaleOf(grid, options);
  const FileSpace space = fileSpaceOf(grid, options);
  scene.toWorld = space.toWorld;
  if (const auto& affine = grid.descriptor.transform.affine; faultOfLattice(*affine).empty())
    scene.indexToWorld = affine;
  Field gaussians = positiveOf(grid.field);
  made.negative = made.ellipsoids - gaussians.ellipsoidCount();
  AmplitudeFit fit(grid, gaussians);
  for (int round = 0; round < kRounds; ++round) fit.improve();
  becomeGaussians(gaussians);
  const std::vector<float> densities = fit.densities();
  const double present = integralOf(gaussians), wanted = integralOf(grid, Density(grid));
  if (!(wanted > 0.0))
    refuse(grid, "its density is 0 in all voxels from " + toString(grid.activeBox.min) + " to " +
                     toString(grid.activeBox.max));
  if (!(present > 0.0))
    refuse(grid,
           "its ellipsoids of a positive intensity have no density where its voxels have some");
  if (!std::isfinite(wanted / present)) refuse(grid, "its density is too large for sums");
  const double extinction =
      scene.densityScale / space.perWorld * (wanted / present);  // in the file
  std::size_t number = 0;
  double whole = 0.0, faint = 0.0;
  for (const Chunk& chunk : gaussians.chunks)
    for (std::size_t i = 0; i < chunk.ellipsoids.size(); ++i, ++number) {
      if (number % kBetweenChecks == 0) throwIfCancelled();
      const double amplitude = extinction * double(chunk.ellipsoids.intensity[i]);
      const Splat splat = splatOf(Gaussian(chunk, i), amplitude, space, options);
      whole += splat.integral;
      if (splat.copies == 0) faint += splat.integral;
      made.clamped += splat.isClamped;
      const Rgb color =
          meanColor(options.colors, std::span(densities).subspan(number * kSamples, kSamples));
      for (int copy = 0; copy < splat.copies; ++copy) append(splat, color, scene.splats);
    }
  made.faintShare = whole > 0.0 ? faint / whole : 0.0;
  if (scene.splats.size() == 0)
    refuse(grid, "all splats would be too faint; raise the density scale");
  return made;
}

}  // namespace esvr
