#include "fit/paper/cpu_paper_pass.h"

namespace esvr::paper {

void CpuPaperPass::gradients(std::span<const Ellipsoid> ellipsoids,
                             std::span<const float> lossByValue, std::span<EllipsoidGradient> out) {
  prepare(ellipsoids);
  forEachBrick([&](std::size_t b) {
    PairTapes& scratch = tapes_.local();
    alignas(64) float sum[kBrickVoxels] = {};
    forwardBrick(b, scratch, sum);
    backwardBrick(b, scratch, lossByValue.data() + b * kBrickVoxels);
  });
  reduce(out);
}

}  // namespace esvr::paper
