#include "fit/paper/paper_field.h"

#include "core/parallel.h"
#include "fit/paper/paper_math.h"
#include "fit/paper/prune.h"

namespace esvr::paper {

Field fieldOf(const Population& population, const KernelKind& kind, ExportFrame frame) {
  std::vector<Ellipsoid> ellipsoids;
  std::vector<double> kappas;
  for (const PaperEllipsoid& p : population.ellipsoids) {
    ellipsoids.push_back(ellipsoidOf(p, kind));
    if (kind.learnK) kappas.push_back(p.k);
  }
  frame.kernel = kernelOf(kind);
  frame.kappas = kappas;
  return exportField(ellipsoids, frame);
}

void dropUnseen(Population& population, const KernelKind& kind, const Box& box) {
  std::vector<double> seen(population.size());
  parallelFor(std::size_t(0), seen.size(), [&](std::size_t i) {
    seen[i] = coverageOf(population.ellipsoids[i], {kind, box, 0.0}).voxels > 0.0 ? 1.0 : 0.0;
  });
  std::size_t count = 0;
  for (const double s : seen) count += s > 0.0 ? 1 : 0;
  keepHighest(population, seen, count);
}

}  // namespace esvr::paper
