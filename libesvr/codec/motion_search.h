#pragma once
/// Finds the motion of a brick since the previous frame.

#include <memory>
#include <span>

#include "codec/frame_coder.h"

namespace esvr::codec {

class MotionSearch {
 public:
  explicit MotionSearch(const PastVoxels& past)
      : past_(past), cube_(std::make_unique<PastCube<kLargestMotion>>()) {}

  /// The motion found from which the previous frame differs least from a brick. The search descends
  /// from no motion and from `expected`, which is taken unless another one is clearly better.
  [[nodiscard]] Coord find(Coord brick, std::span<const std::int32_t> codes, Coord expected);

 private:
  [[nodiscard]] double costOf(Coord motion, std::span<const std::int32_t> codes,
                              Coord expected) const;

  const PastVoxels& past_;
  std::unique_ptr<PastCube<kLargestMotion>> cube_;
};

}  // namespace esvr::codec
