// Scores of ellipsoids by the rays of pictures, as LightGaussian (Fan et al. 2024) has them.

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <numeric>

#include "core/parallel.h"
#include "fit/paper/population.h"

namespace esvr::paper {
namespace {

using Vector = std::array<double, 3>;

/// The limits of opacities of 3D Gaussian Splatting.
constexpr double kLeastOpacity = 1.0 / 255, kMostOpacity = 0.99;
/// Number of sums that are formed at the same time and then added in order.
constexpr int kPartialSums = 16;

double dot(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

Vector cross(const Vector& a, const Vector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

Vector scaled(const Vector& a, double s) { return {a[0] * s, a[1] * s, a[2] * s}; }

/// Parallel rays: their direction and the axes of the picture.
struct View {
  Vector right, up, ahead;
};

/// View k of n, whose directions are points of a Fibonacci lattice on the sphere.
View viewOf(int k, int n) {
  const double z = 1.0 - (2.0 * k + 1.0) / n, r = std::sqrt(1.0 - z * z);
  const double angle = std::numbers::pi * (3.0 - std::sqrt(5.0)) * k;
  const Vector ahead{r * std::cos(angle), r * std::sin(angle), z};
  const Vector other = std::abs(z) < 0.5 ? Vector{0.0, 0.0, 1.0} : Vector{1.0, 0.0, 0.0};
  const Vector across = cross(other, ahead);
  const Vector right = scaled(across, 1.0 / std::sqrt(dot(across, across)));
  return {right, cross(ahead, right), ahead};
}

/// An ellipsoid in the unit frame, as it is seen along rays.
struct Seen {
  KernelConstants<double> kernel;
  Vector center;  ///< relative to the middle of the box
  Matrix3 L;
  double opacity;  ///< at the center, not limited
};

/// The ellipse of an ellipsoid in a picture. The smallest squared distance of a ray from the
/// center, in the unit frame, is uu du^2 + 2 uv du dv + vv dv^2.
struct Ellipse {
  double u, v;        ///< center, pixels from the middle of the picture
  double uu, uv, vv;  ///< see above
  double halfU, halfV;
};

Ellipse ellipseOf(const Seen& p, const View& view) {
  const auto inUnits = [&](const Vector& x) {
    return Vector{dot({p.L[0], p.L[1], p.L[2]}, x), dot({p.L[3], p.L[4], p.L[5]}, x),
                  dot({p.L[6], p.L[7], p.L[8]}, x)};
  };
  const Vector right = inUnits(view.right), up = inUnits(view.up), ahead = inUnits(view.ahead);
  const double depth = dot(ahead, ahead), byRight = dot(ahead, right), byUp = dot(ahead, up);
  Ellipse e{dot(p.center, view.right),
            dot(p.center, view.up),
            dot(right, right) - byRight * byRight / depth,
            dot(right, up) - byRight * byUp / depth,
            dot(up, up) - byUp * byUp / depth,
            0.0,
            0.0};
  const double radius = supportRadius(p.kernel), determinant = e.uu * e.vv - e.uv * e.uv;
  e.halfU = radius * std::sqrt(e.vv / determinant);
  e.halfV = radius * std::sqrt(e.uu / determinant);
  return e;
}

/// The picture of one view, which is drawn from front to back.
class Picture {
 public:
  /// \param radius  voxels from the middle of the box to its corners
  explicit Picture(double radius)
      : half_(int(std::ceil(radius))), side_(2 * half_ + 1), light_(std::size_t(side_) * side_) {}

  void clear() { std::ranges::fill(light_, 1.0f); }

  /// Draws an ellipsoid. \return the sum of its opacity times the light that reaches it
  double draw(const Seen& p, const Ellipse& e) {
    double sum = 0.0;
    for (int y = first(e.v - e.halfV); y <= last(e.v + e.halfV); ++y)
      for (int x = first(e.u - e.halfU); x <= last(e.u + e.halfU); ++x) {
        const double du = x - e.u, dv = y - e.v;
        const double m = e.uu * du * du + 2.0 * e.uv * du * dv + e.vv * dv * dv;
        const double opacity =
            std::min(p.opacity * kernelPhi(p.kernel, std::max(m, 0.0)), kMostOpacity);
        if (opacity < kLeastOpacity) continue;
        float& light = light_[std::size_t(y + half_) * side_ + (x + half_)];
        sum += opacity * light;
        light *= float(1.0 - opacity);
      }
    return sum;
  }

 private:
  [[nodiscard]] int first(double place) const {
    return int(std::clamp(std::ceil(place), -double(half_), double(half_) + 1));
  }
  [[nodiscard]] int last(double place) const {
    return int(std::clamp(std::floor(place), -double(half_) - 1, double(half_)));
  }

  int half_, side_;
  std::vector<float> light_;  ///< transmittance of what was drawn, for each pixel
};

std::vector<Seen> seenFrom(std::span<const PaperEllipsoid> ellipsoids,
                           const CoverageOptions& options) {
  const Box& box = options.box;
  const Vector middle{(double(box.min.x) + box.max.x) / 2, (double(box.min.y) + box.max.y) / 2,
                      (double(box.min.z) + box.max.z) / 2};
  std::vector<Seen> seen;
  for (const auto& ellipsoid : ellipsoids) {
    const Ellipsoid p = ellipsoidOf(ellipsoid, options.kind);
    const Vector center{p.center[0] - middle[0], p.center[1] - middle[1], p.center[2] - middle[2]};
    seen.push_back({constantsOf(ellipsoid, options.kind), center, p.L,
                    std::abs(ellipsoid.intensity) * kLeastOpacity / options.floor});
  }
  return seen;
}

std::vector<std::size_t> fromFrontToBack(std::span<const Seen> seen, const View& view) {
  std::vector<double> depths(seen.size());
  for (std::size_t i = 0; i < seen.size(); ++i) depths[i] = dot(seen[i].center, view.ahead);
  std::vector<std::size_t> order(seen.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, {}, [&](std::size_t i) { return depths[i]; });
  return order;
}

double cornerRadius(const Box& box) {
  const Coord side = box.max - box.min;
  return 0.5 *
         std::sqrt(double(side.x) * side.x + double(side.y) * side.y + double(side.z) * side.z);
}

}  // namespace

std::vector<double> rayContributions(std::span<const PaperEllipsoid> ellipsoids,
                                     const CoverageOptions& options, int views) {
  const std::vector<Seen> seen = seenFrom(ellipsoids, options);
  std::vector<std::vector<double>> parts(kPartialSums, std::vector<double>(seen.size()));
  parallelFor(0, kPartialSums, [&](int part) {
    Picture picture(cornerRadius(options.box));
    for (int k = part; k < views; k += kPartialSums) {
      const View view = viewOf(k, views);
      picture.clear();
      for (const std::size_t i : fromFrontToBack(seen, view))
        parts[part][i] += picture.draw(seen[i], ellipseOf(seen[i], view));
    }
  });
  for (int part = 1; part < kPartialSums; ++part)
    std::ranges::transform(parts[0], parts[part], parts[0].begin(), std::plus());
  return parts[0];
}

}  // namespace esvr::paper
