// Lesson 5: measuring errors.
//
// compareVolumes() measures the errors of a volume against a reference. Empty space counts, but
// takes no time.

#include <cstdio>

#include "esvr/fit.h"
#include "esvr/grid_coding.h"
#include "esvr/metrics.h"
#include "ring.h"

namespace {

esvr::VolumeMetrics qualityOf(const esvr::SparseVolume& ring, std::size_t count) {
  esvr::FitOptions options;
  options.count = count;
  options.preset = esvr::Preset::kDraft;
  const esvr::StoredGrid encoded = esvr::makeStoredGrid({}, ring, esvr::fit(ring, options).field);
  const esvr::SparseVolume back = esvr::decodeGrid(encoded);

  // PSNR over a box includes empty space, which has no error in sparse volumes; PSNR over the
  // active voxels does not. State which one you mean, and give both.
  const esvr::VolumeMetrics m = esvr::compareVolumes(ring, back, {.ssim = true});
  std::printf(
      "%4zu ellipsoids: %.1f dB over the box, %.1f dB over active voxels, largest error "
      "%.3f at %s, overlap %.3f, SSIM %.4f\n",
      count, m.psnrBox, m.psnrActive, m.maxError, esvr::toString(m.maxErrorAt).c_str(), m.iou,
      *m.ssim);
  return m;
}

}  // namespace

int main() {
  const esvr::SparseVolume ring = makeRing();
  const esvr::VolumeMetrics few = qualityOf(ring, 10);
  const esvr::VolumeMetrics many = qualityOf(ring, 80);
  check(many.psnrBox > few.psnrBox, "more ellipsoids have a smaller error");
  check(few.psnrBox > few.psnrActive, "PSNR over the box is higher than over the active voxels");
  check(many.iou > 0.7, "the active voxels are mostly the same");
  check(esvr::compareVolumes(ring, ring).maxError == 0.0, "a volume is equal to itself");
}
