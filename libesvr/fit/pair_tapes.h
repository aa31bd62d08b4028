#pragma once
/// Room for what a forward pass over a brick leaves for the backward one.

#include <cstddef>
#include <memory>
#include <new>
#include <vector>

#include "esvr/sparse_volume.h"
#include "field/brick_kernels.h"

namespace esvr {

/// A thread's tapes of the pairs of one brick.
class PairTapes {
 public:
  void reserve(std::size_t pairs) {
    tapes.resize(pairs);
    if (pairs * kBrickVoxels <= capacity_) return;
    capacity_ = 2 * pairs * kBrickVoxels;
    phi.reset(
        static_cast<float*>(::operator new[](capacity_ * sizeof(float), std::align_val_t(kAlign))));
  }

 private:
  static constexpr std::size_t kAlign = 64;  // of the widest vectors
  struct AlignedDelete {
    void operator()(float* p) const { ::operator delete[](p, std::align_val_t(kAlign)); }
  };
  std::size_t capacity_ = 0;

 public:
  std::vector<PairTape> tapes;
  std::unique_ptr<float[], AlignedDelete> phi;  ///< kBrickVoxels a pair at most
};

}  // namespace esvr
