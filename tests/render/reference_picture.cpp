#include "render/reference_picture.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "field/line_form.h"
#include "render/reference_light.h"
#include "render/view.h"

namespace esvr::test {
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
  for (int j = 0; j * o.step <= scene.farthest; ++j)
    light.add(scene.value(sum(ray.origin, scaled(ray.direction, j * o.step))));
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
  double largest = 0.0;
  for (std::size_t i = 0; i < a.rgba.size(); ++i)
    largest = std::max(largest, std::abs(double(a.rgba[i]) - b.rgba.at(i)));
  return largest;
}

}  // namespace esvr::test
