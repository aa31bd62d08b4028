#include "render/ellipsoid_view.h"

#include <cmath>

namespace esvr {
namespace {

PackedEllipsoid packedOne(const Ellipsoids& e, std::size_t i, std::uint32_t chunk) {
  PackedEllipsoid p{};
  for (int a = 0; a < 3; ++a) {
    p.center[a] = e.center[a][i];
    p.scale[a] = float(std::exp(double(e.logScale[a][i])));
  }
  for (int a = 0; a < 4; ++a) p.rotation[a] = e.rotation[a][i];
  p.intensity = e.intensity[i];
  p.chunk = chunk;
  return p;
}

RayKernel rayKernel(const Kernel& kernel, double kappa) {
  constexpr double kLog2e = 1.4426950408889634;
  const auto k = kernelConstants<double>(kernel, kappa);
  return {float(k.numerator), float(k.plateau), float(k.shift * kLog2e), float(k.base),
          float(k.cutoff)};
}

bool hasOwnKernels(const Field& field) {
  for (const Chunk& chunk : field.chunks)
    if (!chunk.ellipsoids.kappa.empty()) return true;
  return false;
}

}  // namespace

std::vector<PackedEllipsoid> packed(const Field& field) {
  std::vector<PackedEllipsoid> all;
  all.reserve(field.ellipsoidCount());
  for (std::uint32_t c = 0; c < field.chunks.size(); ++c)
    for (std::size_t i = 0; i < field.chunks[c].ellipsoids.size(); ++i)
      all.push_back(packedOne(field.chunks[c].ellipsoids, i, c));
  return all;
}

std::vector<Vec3> chunkOrigins(const Field& field) {
  std::vector<Vec3> origins;
  for (const Chunk& chunk : field.chunks)
    origins.push_back({double(chunk.origin.x), double(chunk.origin.y), double(chunk.origin.z)});
  return origins;
}

std::vector<RayKernel> rayKernels(const Field& field) {
  if (!hasOwnKernels(field)) return {rayKernel(field.kernel, field.kernel.kappa)};
  std::vector<RayKernel> kernels;
  for (const Chunk& chunk : field.chunks)
    for (std::size_t i = 0; i < chunk.ellipsoids.size(); ++i) {
      const auto& kappa = chunk.ellipsoids.kappa;
      kernels.push_back(rayKernel(field.kernel, kappa.empty() ? field.kernel.kappa : kappa[i]));
    }
  return kernels;
}

VisibleEllipsoids visibleEllipsoids(const Field& field, const View& view, Resolution resolution) {
  const auto ellipsoids = packed(field);
  const auto origins = chunkOrigins(field);
  const auto kernels = rayKernels(field);
  VisibleEllipsoids out;
  for (std::size_t i = 0; i < ellipsoids.size(); ++i) {
    const PackedEllipsoid& e = ellipsoids[i];
    const RayKernel& kernel = kernels[kernels.size() == 1 ? 0 : i];
    const SeenEllipsoid seen = seenBy(view, e, difference(origins[e.chunk], view.eye));
    const ScreenExtent s = screenExtentOf(view, seen, std::sqrt(double(kernel.cutoff)), resolution);
    if (!visible(s.bounds)) continue;
    out.bounds.push_back(s.bounds);
    out.views.push_back(viewOf(view, seen, s.outline.everywhere, e.intensity, kernel));
  }
  return out;
}

}  // namespace esvr
