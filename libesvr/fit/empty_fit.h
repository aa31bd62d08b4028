#pragma once
/// The fit of a volume whose values all equal its background: the empty sum is exact.

#include "esvr/fit.h"
#include "fit/recorder.h"
#include "fit/target.h"

namespace esvr {

[[nodiscard]] inline bool isEmpty(const TargetScale& scale) {
  return scale.lowest == 0.0 && scale.highest == 0.0;
}

[[nodiscard]] inline FitResult emptyFit(const SparseVolume& volume, float kappa) {
  FitResult result;
  result.field.background = volume.background;
  result.field.kernel.kappa = kappa;
  result.range = {volume.background, volume.background};
  TimedCurvePoint point;
  point.psnrBox = point.psnrActive = kPerfectPsnr;
  result.curve.push_back(point);
  return result;
}

}  // namespace esvr
