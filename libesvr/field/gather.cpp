#include "field/gather.h"

namespace esvr {
namespace {

double kappaOf(const Field& field, const Ellipsoids& e, std::size_t i) {
  return e.kappa.empty() ? double(field.kernel.kappa) : double(e.kappa[i]);
}

std::array<double, 3> centerOf(const Ellipsoids& e, std::size_t i) {
  return {e.center[0][i], e.center[1][i], e.center[2][i]};
}

bool perEllipsoidKappa(const Field& field) {
  for (const auto& chunk : field.chunks)
    if (!chunk.ellipsoids.kappa.empty()) return true;
  return false;
}

template <class Visit>
void forEachEllipsoid(const Field& field, Visit&& visit) {
  for (std::uint32_t c = 0; c < field.chunks.size(); ++c)
    for (std::size_t i = 0; i < field.chunks[c].ellipsoids.size(); ++i)
      visit(c, field.chunks[c], i);
}

}  // namespace

GatheredField gather(const Field& field) {
  GatheredField g;
  for (const auto& chunk : field.chunks) g.origins.push_back(chunk.origin);
  const bool several = perEllipsoidKappa(field);
  if (!several) g.kernels.push_back(kernelConstants<float>(field.kernel));
  forEachEllipsoid(field, [&](std::uint32_t c, const Chunk& chunk, std::size_t i) {
    const Ellipsoids& e = chunk.ellipsoids;
    const double kappa = kappaOf(field, e, i);
    const double radius = supportRadius(kernelConstants<double>(field.kernel, kappa));
    g.forms.push_back(makeLineForm(centerOf(e, i), unitFrame(e, i), radius, e.intensity[i]));
    if (several) g.kernels.push_back(kernelConstants<float>(field.kernel, kappa));
    g.chunkOf.push_back(c);
  });
  return g;
}

std::vector<Support> supports(const Field& field) {
  std::vector<Support> all;
  forEachEllipsoid(field, [&](std::uint32_t, const Chunk& chunk, std::size_t i) {
    const Ellipsoids& e = chunk.ellipsoids;
    auto center = centerOf(e, i);
    center[0] += chunk.origin.x, center[1] += chunk.origin.y, center[2] += chunk.origin.z;
    const double radius =
        supportRadius(kernelConstants<double>(field.kernel, kappaOf(field, e, i)));
    all.push_back(makeSupport(center, unitFrame(e, i), radius, kRoundingSlack));
  });
  return all;
}

}  // namespace esvr
