#pragma once
/// What the host hears of the steps that it has started.

#include <cstddef>
#include <cstdint>

#include "fit/cuda/halt.h"

namespace esvr::cuda {

struct StepStatus {
  static constexpr std::size_t kMaxAhead = 64;  ///< steps that can be started without a look

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
  /// \return whether the lists serve another step
  [[nodiscard]] bool canGoOn(std::size_t started) const { return halted[started] == 0; }
};

}  // namespace esvr::cuda
