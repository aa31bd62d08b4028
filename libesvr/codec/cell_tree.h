#pragma once
/// Codes a set of sorted Morton keys as a tree: for every split it stores how many keys have a 0 in
/// the next bit. The order of ellipsoids in a cell has no meaning, and in this form it costs no
/// bits.

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <span>

#include "codec/symbol_coder.h"
#include "esvr/error.h"

namespace esvr::codec {

/// \tparam Side  with a Writer, code() takes sorted keys; with a Reader it takes zeros and sets the
///               keys
template <class Side>
class CellTree {
 public:
  explicit CellTree(Side& side) : side_(side) {}

  /// \param bits  number of bits of a key
  void code(std::span<std::uint64_t> keys, int bits) {
    if (keys.empty() || bits == 0) return;
    const std::uint64_t bit = std::uint64_t{1} << (bits - 1);
    const auto n = std::uint32_t(keys.size());
    const auto right = std::find_if(keys.begin(), keys.end(), [bit](auto k) { return k & bit; });
    const std::uint32_t zeros = codeSplit(n, std::uint32_t(right - keys.begin()), bits);
    if (zeros > n) throw BadInput("a split of more ellipsoids than there are");
    for (auto& key : keys.subspan(zeros)) key |= bit;
    code(keys.first(zeros), bits - 1);
    code(keys.subspan(zeros), bits - 1);
  }

 private:
  static constexpr std::uint32_t kSmall = 16;
  static constexpr int kSmallBits = 4;

  std::uint32_t codeSplit(std::uint32_t n, std::uint32_t zeros, int level) {
    if (n == 1) return side_.bit(single_[std::size_t(level)], zeros != 0) ? 1 : 0;
    if (n < kSmall) return small_[n].code(side_, zeros);
    return codeLarge(n, zeros);
  }

  /// Codes the number of zeros as its distance from half of the keys.
  std::uint32_t codeLarge(std::uint32_t n, std::uint32_t zeros) {
    const auto width = std::size_t(std::bit_width(n));
    const std::uint32_t half = n / 2;
    const bool above = side_.bit(above_[width], zeros > half);
    const std::uint32_t distance = large_[width].code(side_, above ? zeros - half : half - zeros);
    if (above) return half + distance;
    return distance > half ? n + 1 : half - distance;
  }

  Side& side_;
  std::array<BitModel, 64> single_;
  std::array<TreeModel<kSmallBits>, kSmall> small_;
  std::array<BitModel, 33> above_;
  std::array<NumberModel, 33> large_;
};

}  // namespace esvr::codec
