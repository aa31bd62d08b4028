#pragma once
/// Memory for the tapes that a forward pass over a brick leaves for the backward pass.

#include <algorithm>
#include <cstddef>
#include <memory>
#include <new>
#include <span>
#include <vector>

#include "esvr/sparse_volume.h"
#include "field/brick_kernels.h"

namespace esvr {

/// Uninitialised floats with the alignment of the widest SIMD vectors.
class AlignedFloats {
 public:
  AlignedFloats() = default;
  explicit AlignedFloats(std::size_t size)
      : floats_(
            static_cast<float*>(::operator new[](size * sizeof(float), std::align_val_t(kAlign)))) {
  }
  [[nodiscard]] float* get() const { return floats_.get(); }

 private:
  static constexpr std::size_t kAlign = 64;
  struct Delete {
    void operator()(float* p) const { ::operator delete[](p, std::align_val_t(kAlign)); }
  };
  std::unique_ptr<float[], Delete> floats_;
};

/// A thread's tapes for the pairs of one brick. The memory is reused for the next brick.
struct PairTapes {
  std::vector<PairTape> tapes;
  AlignedFloats phi;  ///< at most kBrickVoxels values for each pair
  std::size_t capacity = 0;

  void reserve(std::size_t pairs) {
    tapes.resize(pairs);
    if (pairs * kBrickVoxels <= capacity) return;
    capacity = 2 * pairs * kBrickVoxels;
    phi = AlignedFloats(capacity);
  }
};

/// Tapes of one brick that are kept between passes without gaps. The memory is reused.
class KeptTapes {
 public:
  void keep(std::span<const PairTape> from) {
    std::size_t floats = 0;
    for (const PairTape& tape : from) floats += std::size_t(tape.floats);
    if (floats > capacity_) {
      capacity_ = floats + floats / kSpare;
      phi_ = AlignedFloats(capacity_);
    }
    tapes_.assign(from.begin(), from.end());
    float* at = phi_.get();
    for (PairTape& tape : tapes_) {
      std::copy_n(tape.phi, tape.floats, at);
      tape.phi = at;
      at += tape.floats;
    }
  }
  [[nodiscard]] std::span<const PairTape> tapes() const { return tapes_; }

 private:
  static constexpr std::size_t kSpare = 8;  ///< 1/8 more is allocated, since shapes change a little
  std::vector<PairTape> tapes_;
  AlignedFloats phi_;
  std::size_t capacity_ = 0;
};

}  // namespace esvr
