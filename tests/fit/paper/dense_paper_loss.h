#pragma once
/// The paper's loss by its definition, in float64 over every voxel of a box, with SSIM as in the
/// textbook. It shares neither the bricks nor the form of SSIM with the library.

#include <optional>
#include <vector>

#include "esvr/volume.h"

namespace esvr::test {

/// The values of a box's voxels, which are zero outside.
class DenseValues {
 public:
  explicit DenseValues(const Box& box) : box_(box), values_(std::size_t(box.volume())) {}

  [[nodiscard]] const Box& box() const { return box_; }
  [[nodiscard]] double at(Coord v) const { return box_.contains(v) ? values_[offset(v)] : 0.0; }
  [[nodiscard]] double& operator[](Coord v) { return values_[offset(v)]; }

 private:
  [[nodiscard]] std::size_t offset(Coord v) const {
    const Coord side = box_.max - box_.min + Coord{1, 1, 1}, local = v - box_.min;
    return (std::size_t(local.x) * std::size_t(side.y) + std::size_t(local.y)) *
               std::size_t(side.z) +
           std::size_t(local.z);
  }
  Box box_;
  std::vector<double> values_;
};

struct DenseLossOptions {
  double voxels, beta, peak;
  std::optional<Box> windows{};  ///< voxels whose windows count; default: all

  [[nodiscard]] bool counts(Coord v) const { return !windows || windows->contains(v); }
};

/// Evaluates the loss. The box must extend at least 5 voxels, the radius of a window, beyond all
/// values that are not zero.
double densePaperLoss(const DenseValues& prediction, const DenseValues& target,
                      const DenseLossOptions& options);

/// Its derivative by the voxels of the prediction, by the chain rule through the moments m1 = w *
/// p, m2 = w * p^2 and m12 = w * (p t).
DenseValues densePaperLossGradient(const DenseValues& prediction, const DenseValues& target,
                                   const DenseLossOptions& options);

}  // namespace esvr::test
