#include "fit/paper/initial_points.h"

#include <algorithm>
#include <cmath>

#include "fit/kernel_moments.h"
#include "fit/sampling_options.h"

namespace esvr::paper {
namespace {

/// Distances between evenly spread spheres that a sphere reaches. A Gaussian that ends at 3 sigma
/// reaches as far if its sigma is the distance, as in 3D Gaussian Splatting. An ellipsoid of the same
/// scale would reach 1.42 distances, and pruning then loses 9 dB of Aneurysm (docs/figures/benchmarks.md, "The
/// paper's method").
constexpr double kReach = 3.0;

std::uint64_t voxelsToDrawFrom(const FitTarget& target) {
  return std::uint64_t(target.values.size()) -
         std::uint64_t(std::count(target.values.begin(), target.values.end(), 0.0f));
}

}  // namespace

std::vector<PaperEllipsoid> initialPoints(const FitTarget& target, std::size_t points,
                                          const KernelKind& kind, std::uint64_t seed) {
  const std::uint64_t voxels = voxelsToDrawFrom(target);
  const std::uint64_t count = std::min<std::uint64_t>(points, voxels);
  const double each = double(voxels) / double(std::max<std::uint64_t>(count, 1));
  const double units = kind.unitsPerScale(kind.k);
  const auto kernel = kernelConstants<double>(kernelOf(kind));
  const double scale = kReach * std::cbrt(each) * units / supportRadius(kernel);
  // the sum of a sphere over all voxels for an intensity of 1, shared among the voxels of a sphere
  const double overlap = kernelMoments(kernel).mass * std::pow(scale / units, 3.0) / each;

  std::vector<PaperEllipsoid> drawn;
  const auto nextAt = [&] {
    const auto n = double(drawn.size());
    return std::uint64_t((n + sampleUniform(seed, drawn.size())) * each);
  };
  std::uint64_t passed = 0, wanted = nextAt();
  for (std::size_t i = 0; i < target.values.size() && drawn.size() < count; ++i) {
    if (target.values[i] == 0.0f || passed++ != wanted) continue;
    const Coord v =
        target.bricks[i / kBrickVoxels] * kBrickSide + voxelLocal(int(i % kBrickVoxels));
    PaperEllipsoid p{
        {double(v.x), double(v.y), double(v.z)}, {}, {1.0, 0.0, 0.0, 0.0}, 0.0, kind.k};
    p.logScale.fill(std::log(scale));
    p.intensity = double(target.values[i]) / overlap;
    drawn.push_back(p);
    wanted = std::max(nextAt(), wanted + 1);
  }
  return drawn;
}

}  // namespace esvr::paper
