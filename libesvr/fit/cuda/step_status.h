#pragma once
/// The status of the started steps, which the host reads back.

#include <cstddef>

#include "fit/cuda/halt.h"

namespace esvr::cuda {

struct StepStatus {
  static constexpr std::size_t kMaxAhead = 64;  ///< steps that can be started before it is read

  double loss;                ///< sum of r^2 before the last step that was taken
  int diverged;               ///< not 0 if an ellipsoid is not finite
  int halted[kMaxAhead + 1];  ///< [n] is not 0 if step n and those after it were not taken

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
