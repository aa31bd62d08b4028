#pragma once
/// The status of the started steps, which the host reads back.

#include <cstddef>
#include <cstdint>

#include "fit/cuda/halt.h"

namespace esvr::cuda {

struct StepStatus {
  static constexpr std::size_t kMaxAhead = 64;  ///< steps that can be started before it is read

  double loss;                ///< sum of r^2 before the last step that was taken
  int diverged;               ///< not 0: an ellipsoid is not finite
  std::uint32_t refused;      ///< steps of ellipsoids that were refused since the lists were built
  int halted[kMaxAhead + 1];  ///< not 0 in place n: step n was not taken, nor were those after it

  /// \return how many of the steps were taken
  [[nodiscard]] std::size_t taken(std::size_t started) const {
    std::size_t n = 0;
    while (n < started && halted[n] == 0) ++n;
    return n;
  }
  /// \return true if the lists are still valid after the started steps
  [[nodiscard]] bool canGoOn(std::size_t started) const { return halted[started] == 0; }
};

}  // namespace esvr::cuda
