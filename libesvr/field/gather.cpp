#include "field/gather.h"

#include "core/parallel.h"

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

/// Calls visit(number, chunk's number, chunk, index in the chunk) for every ellipsoid, in parallel.
template <class Visit>
void forEachEllipsoid(const Field& field, Visit&& visit) {
  constexpr std::size_t kGrain = 1024;
  std::size_t first = 0;
  for (std::uint32_t c = 0; c < field.chunks.size(); ++c) {
    const Chunk& chunk = field.chunks[c];
    const tbb::blocked_range<std::size_t> all(0, chunk.ellipsoids.size(), kGrain);
    parallelFor(all, [&](const auto& range) {
      for (std::size_t i = range.begin(); i != range.end(); ++i) visit(first + i, c, chunk, i);
    });
    first += chunk.ellipsoids.size();
  }
}

}  // namespace

GatheredField gather(const Field& field) {
  GatheredField g;
  const std::size_t count = field.ellipsoidCount();
  for (const auto& chunk : field.chunks) g.origins.push_back(chunk.origin);
  const bool several = perEllipsoidKappa(field);
  g.forms.resize(count);
  g.chunkOf.resize(count);
  g.kernels.resize(several ? count : 1, kernelConstants<float>(field.kernel));
  forEachEllipsoid(field, [&](std::size_t n, std::uint32_t c, const Chunk& chunk, std::size_t i) {
    const Ellipsoids& e = chunk.ellipsoids;
    const double kappa = kappaOf(field, e, i);
    const double radius = supportRadius(kernelConstants<double>(field.kernel, kappa));
    g.forms[n] = makeLineForm(centerOf(e, i), unitFrame(e, i), radius, e.intensity[i]);
    if (several) g.kernels[n] = kernelConstants<float>(field.kernel, kappa);
    g.chunkOf[n] = c;
  });
  return g;
}

std::vector<Support> supports(const Field& field, double slack) {
  std::vector<Support> all(field.ellipsoidCount());
  forEachEllipsoid(field, [&](std::size_t n, std::uint32_t, const Chunk& chunk, std::size_t i) {
    const Ellipsoids& e = chunk.ellipsoids;
    auto center = centerOf(e, i);
    center[0] += chunk.origin.x, center[1] += chunk.origin.y, center[2] += chunk.origin.z;
    const double radius =
        supportRadius(kernelConstants<double>(field.kernel, kappaOf(field, e, i)));
    all[n] = makeSupport(center, unitFrame(e, i), radius, slack);
  });
  return all;
}

}  // namespace esvr
