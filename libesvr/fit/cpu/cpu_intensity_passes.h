#pragma once
/// IntensityPasses on the CPU.

#include "core/brick_index.h"
#include "field/brick_kernels.h"
#include "field/evaluate_plan.h"
#include "field/voxel_rule.h"
#include "fit/cpu/pair_tapes.h"
#include "fit/intensity_passes.h"

namespace esvr {

class CpuIntensityPasses final : public IntensityPasses {
 public:
  explicit CpuIntensityPasses(const IntensityTarget& target);

  void setShapes(const Field& field) override;
  [[nodiscard]] StoredError error(std::span<const float> intensities) override;
  StoredError gradient(std::span<const float> intensities, IntensityGradient& out) override;
  void applyNormal(std::span<const double> direction, std::vector<double>& out) override;

 private:
  template <class Number>
  void setForms(std::span<const Number> intensities);
  /// Residuals of one brick; they are zero at voxels that a reader gets exactly.
  StoredError residualOf(std::size_t brick, float* sum, BrickMask* exact) const;
  std::span<const PairTape> forward(std::size_t brick, PairTapes& scratch, float* sum);
  template <class Middle>
  void pass(bool backward, const Middle& middle);
  void sumPairs(float PairProjection::*value, std::vector<double>& out) const;
  [[nodiscard]] StoredError total() const;

  const SparseVolume& source_;
  VoxelRule stored_;
  Box box_;
  bool restricted_;
  BrickIndex known_;  ///< bricks that do not depend on the field
  float background_ = 0.0f;
  std::vector<Coord> corners_;        ///< corners of known bricks, then of others in reach
  std::vector<const float*> wanted_;  ///< source's values of known bricks; null: background
  EvaluatePlan plan_;
  bool keeps_ = false, kept_ = false;  ///< whether tapes shall be kept; whether they are valid
  std::vector<KeptTapes> tapes_;       ///< tapes of each brick
  std::vector<PairProjection> projections_;
  std::vector<StoredError> brickError_;
  std::vector<BrickMask> exact_;
};

}  // namespace esvr
