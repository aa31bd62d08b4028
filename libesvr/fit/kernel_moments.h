#pragma once
/// Moments of phi over the unit frame, in which m is the squared distance from the center.

#include "esvr/kernel.h"

namespace esvr {

struct KernelMoments {
  double mass;      ///< integral of phi
  double variance;  ///< along an axis, of the density that is proportional to phi
};
[[nodiscard]] KernelMoments kernelMoments(const KernelConstants<double>& kernel);

}  // namespace esvr
