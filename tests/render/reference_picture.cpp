#include "render/reference_picture.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "field/line_form.h"
#include "render/view.h"

namespace esvr::test {

namespace {

constexpr int kIntervals = 1 << 16;
constexpr int kParts = 4;  // of a divided segment
constexpr double kMaxExtinction = 64.0, kThin = 0.25, kMaxPieces = 16.0;
constexpr std::size_t kExtinction = 3;

}  // namespace

Channels channelsAt(const TransferFunction& f, double value, double length) {
  const double extinction =
      std::min(-std::log1p(-opacityAt(f.opacity, value)) * length, kMaxExtinction);
  const Rgb c = colorAt(f.colors, value);
  return {c.r * extinction, c.g * extinction, c.b * extinction, extinction};
}

Integrals::Integrals(const TransferFunction& f, double length)
    : function_(f),
      length_(length),
      low_(std::min(f.colors.points.front().x, f.opacity.front().x)) {
  const double high = std::max(f.colors.points.back().x, f.opacity.back().x);
  scale_ = high > low_ ? kIntervals / (high - low_) : 1.0;
  means_.push_back(at(std::nextafter(low_, -1e300)));
  for (int i = 0; i < kIntervals; ++i)
    means_.push_back(at(high > low_ ? low_ + (i + 0.5) / scale_ : low_));
  means_.push_back(at(high));
  for (const Channels& mean : means_)
    mostExtinction_ = std::max(mostExtinction_, mean[kExtinction]);
  Channels before{};
  for (std::size_t n = 0; n < means_.size(); ++n) {
    before_.push_back(before);
    for (std::size_t c = 0; n > 0 && c < before.size(); ++c) before[c] += means_[n][c];
  }
}

double Integrals::placeOf(double value) const { return (value - low_) * scale_; }

double Integrals::upTo(double place, std::size_t channel) const {
  if (place < 0.0) return place * means_.front()[channel];
  const double interval = std::min(std::floor(place), double(kIntervals));
  const std::size_t n = std::size_t(interval) + 1;
  return before_[n][channel] + (place - interval) * means_[n][channel];
}

Channels Integrals::meanBetween(double a, double b) const {
  const double from = placeOf(std::min(a, b)), to = placeOf(std::max(a, b));
  if (to - from < 1e-3) return at(0.5 * (a + b));
  Channels mean;
  for (std::size_t c = 0; c < mean.size(); ++c)
    mean[c] = (upTo(to, c) - upTo(from, c)) / (to - from);
  return mean;
}

bool Integrals::bends(double a, double b, double changeBefore, double weight) const {
  constexpr double kLeastBend = 1.0 / 16.0;
  const double bend = std::abs(b - a - changeBefore) * scale_;
  const double opacity = -std::expm1(-mostExtinction_);
  if (!(bend * weight * opacity > kLeastBend * kIntervals)) return false;
  return placeOf(std::min(a, b)) - bend < kIntervals && placeOf(std::max(a, b)) + bend > 0.0;
}

void LightOnRay::add(double value, double length) {
  if (classification_ == Classification::kPreIntegrated) addSegment(last_, value, length);
  if (classification_ == Classification::kPost && value != background_)
    absorb(integrals_.at(value), 1.0);
  change_ = value == background_ ? 0.0 : (value - last_) / length;
  last_ = value;
}

bool LightOnRay::bends(double value) const {
  return classification_ == Classification::kPreIntegrated &&
         integrals_.bends(last_, value, change_, light_.transmittance);
}

void LightOnRay::addSegment(double a, double b, double length) {
  if (a == background_ && b == background_) return;
  const double extinction = integrals_.meanBetween(a, b)[kExtinction] * length;
  const double pieces = std::clamp(std::ceil(extinction / kThin), 1.0, kMaxPieces);
  for (double p = 0; p < pieces; ++p)
    absorb(integrals_.meanBetween(a + (b - a) * p / pieces, a + (b - a) * (p + 1) / pieces),
           length / pieces);
}

void LightOnRay::absorb(const Channels& mean, double length) {
  if (!(mean[kExtinction] > 0.0)) return;
  const double alpha = -std::expm1(-mean[kExtinction] * length);
  const double weight = light_.transmittance * alpha / mean[kExtinction];
  light_.r += weight * mean[0], light_.g += weight * mean[1], light_.b += weight * mean[2];
  light_.transmittance *= 1.0 - alpha;
}

namespace {

struct Ellipsoid {
  Vec3 center;
  Matrix3 L;
  KernelConstants<double> kernel;
  double intensity;
};

Ellipsoid ellipsoidOf(const Field& field, const Chunk& chunk, std::size_t i) {
  const Ellipsoids& e = chunk.ellipsoids;
  const double kappa = e.kappa.empty() ? double(field.kernel.kappa) : double(e.kappa[i]);
  return {{double(chunk.origin.x) + e.center[0][i], double(chunk.origin.y) + e.center[1][i],
           double(chunk.origin.z) + e.center[2][i]},
          unitFrame(e, i),
          kernelConstants<double>(field.kernel, kappa),
          e.intensity[i]};
}

double valueOf(const Ellipsoid& e, const Vec3& place) {
  double m = 0.0;
  for (int r = 0; r < 3; ++r) {
    double u = 0.0;
    for (int c = 0; c < 3; ++c) u += e.L[3 * r + c] * (place[c] - e.center[c]);
    m += u * u;
  }
  return e.intensity * kernelPhi(e.kernel, m);
}

Light lightAlong(const Ray& ray, const SampledScene& scene, const Integrals& integrals,
                 const RenderOptions& o) {
  LightOnRay light(integrals, scene.background, o.classification);
  const auto valueAt = [&](double sample) {
    if (sample < 0.0) return scene.background;  // before the eye
    return scene.value(sum(ray.origin, scaled(ray.direction, sample * o.step)));
  };
  for (int j = 0; j * o.step <= scene.farthest; ++j) {
    const double value = valueAt(j);
    const int parts = scene.divides && light.bends(value) ? kParts : 1;
    for (int p = 1; p <= parts; ++p)
      light.add(p == parts ? value : valueAt(j - 1 + double(p) / parts), 1.0 / parts);
  }
  return light.light();
}

}  // namespace

ValueAtPlace sumOfEllipsoids(const Field& field) {
  std::vector<Ellipsoid> all;
  for (const Chunk& chunk : field.chunks)
    for (std::size_t i = 0; i < chunk.ellipsoids.size(); ++i)
      all.push_back(ellipsoidOf(field, chunk, i));
  return [all, background = double(field.background)](const Vec3& place) {
    double value = background;
    for (const Ellipsoid& e : all) value += valueOf(e, place);
    return value;
  };
}

double trilinear(const SparseVolume& volume, const Vec3& place) {
  const Coord low{int(std::floor(place[0])), int(std::floor(place[1])), int(std::floor(place[2]))};
  const double x = place[0] - low.x, y = place[1] - low.y, z = place[2] - low.z;
  double value = 0.0;
  for (int c = 0; c < 8; ++c) {
    const Coord step{c >> 2, (c >> 1) & 1, c & 1};
    const double weight = (step.x ? x : 1.0 - x) * (step.y ? y : 1.0 - y) * (step.z ? z : 1.0 - z);
    value += weight * double(valueAt(volume, low + step));
  }
  return value;
}

Image referencePicture(const SampledScene& scene, const RenderOptions& o) {
  const View view(o.camera, o.resolution);
  const Integrals integrals(o.transfer, o.step / o.opacityLength);
  Image image{o.resolution.width, o.resolution.height, {}};
  for (int row = 0; row < image.height; ++row)
    for (int column = 0; column < image.width; ++column) {
      const Light l = lightAlong(view.ray(column, row), scene, integrals, o);
      for (const double v : {l.r, l.g, l.b, 1.0 - l.transmittance}) image.rgba.push_back(float(v));
    }
  return image;
}

double imagePsnr(const Image& a, const Image& b) {
  double squares = 0.0;
  for (std::size_t i = 0; i < a.rgba.size(); ++i)
    squares += std::pow(double(a.rgba[i]) - b.rgba.at(i), 2);
  return squares == 0.0 ? std::numeric_limits<double>::infinity()
                        : -10.0 * std::log10(squares / double(a.rgba.size()));
}

double largestDifference(const Image& a, const Image& b) {
  double largest = a.rgba.size() == b.rgba.size() ? 0.0 : 1.0;
  for (std::size_t i = 0; i < std::min(a.rgba.size(), b.rgba.size()); ++i)
    largest = std::max(largest, std::abs(double(a.rgba[i]) - double(b.rgba[i])));
  return largest;
}

void expectAnyLight(const Image& image) {
  EXPECT_GT(std::ranges::count_if(image.rgba, [](float v) { return v > 0.0f; }), 0);
}

void expectTransparent(const Image& image) {
  EXPECT_FALSE(image.rgba.empty());
  for (const float v : image.rgba) ASSERT_EQ(v, 0.0f);
}

void expectClose(const Image& image, const Image& expected, std::size_t many) {
  ASSERT_EQ(image.rgba.size(), expected.rgba.size());
  std::size_t different = 0, lit = 0;
  for (std::size_t i = 0; i < image.rgba.size(); ++i) {
    different += std::abs(image.rgba[i] - expected.rgba[i]) > 1.0f / 255.0f;
    lit += expected.rgba[i] > 0.1f;
  }
  EXPECT_LE(different, image.rgba.size() / many);
  EXPECT_GT(lit, 0u) << "an empty picture proves nothing";
}

}  // namespace esvr::test
