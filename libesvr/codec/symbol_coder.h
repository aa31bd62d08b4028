#pragma once
/// The entropy coder of voxels: adaptive symbols of up to 16 values, coded by asymmetric numeral systems (docs/format.md,
/// "The symbol coder").
///
/// One symbol takes the place of a chain of binary decisions, and a reader needs no division. What is written last is
/// read first: a writer collects the steps of a part of a stream and turns them into words from the last to the first.
/// As for the range coder, coders of voxels are templates of a side. It is a SymbolWriter, a SymbolReader, or a
/// SymbolMeter, which measures what a writer would write. Only integers are used, so that every machine reads the same.

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <span>
#include <vector>
#ifdef __SSE2__
#include <emmintrin.h>
#endif

#include "codec/range_coder.h"

namespace esvr::codec {

/// Shares of symbols are in units of 2^-16.
inline constexpr int kShareBits = 16;
inline constexpr std::uint32_t kWholeShare = 1u << kShareBits;

/// The interval of a symbol among the positions from 0 to kWholeShare - 1.
struct SymbolShare {
  std::uint32_t start = 0, share = 0;
};

/// Learns the shares of up to 16 symbols. A symbol moves the boundaries of all intervals towards those at which its own
/// interval has nearly everything. No branch depends on the symbol, which a processor could not foresee.
class SymbolModel {
 public:
  static constexpr std::int32_t kSymbols = 16;

  /// \param symbols  number of symbols that occur, from 1 to kSymbols; the others have the least share
  explicit SymbolModel(std::int32_t symbols = kSymbols) {
    for (std::int32_t s = 0; s < kSymbols; ++s)
      start_[std::size_t(s)] = s * kLeast + std::min(s, symbols) * (kFree / symbols);
    start_[kSymbols] = kOne;
  }

  [[nodiscard]] SymbolShare of(std::uint32_t symbol) const {
    const std::uint32_t start = std::uint32_t(start_[symbol]) >> kDropped;
    return {start, (std::uint32_t(start_[symbol + 1]) >> kDropped) - start};
  }

  /// The symbol whose interval contains a position.
  [[nodiscard, gnu::always_inline]] std::uint32_t at(std::uint32_t position) const {
    const auto last = std::int32_t(((position + 1u) << kDropped) - 1u);
#ifdef __SSE2__
    const auto isBeyond = [&](std::size_t first) {
      const auto* starts = reinterpret_cast<const __m128i*>(&start_[first]);
      return _mm_cmpgt_epi32(_mm_loadu_si128(starts), _mm_set1_epi32(last));
    };
    const __m128i low = _mm_packs_epi32(isBeyond(0), isBeyond(4));
    const __m128i high = _mm_packs_epi32(isBeyond(8), isBeyond(12));
    const auto beyond = std::uint32_t(_mm_movemask_epi8(_mm_packs_epi16(low, high)));
    return std::uint32_t(std::countr_zero(beyond | 1u << kSymbols)) - 1u;
#else
    std::uint32_t begun = 0;
    for (std::size_t s = 0; s < kSymbols; ++s) begun += start_[s] <= last ? 1u : 0u;
    return begun - 1u;
#endif
  }

  /// Symbol number n, counted from 0, moves the boundaries by 1/2, 1/4, ... of the distance, which is about 1.3/(n + 1.5)
  /// and 1/128 in the end.
  [[gnu::always_inline]] void learn(std::uint32_t symbol) {
    const int shift = kShifts[count_];
    const Lanes wanted = Lanes{} + std::int32_t(symbol);
    Lanes lane{0, 1, 2, 3};
    for (std::size_t s = 0; s < kSymbols; s += kLanes, lane += std::int32_t(kLanes)) {
      Lanes start;
      std::memcpy(&start, &start_[s], sizeof start);
      const Lanes target = lane * kLeast + ((lane > wanted) & kFree);
      start += (target - start) >> shift;
      std::memcpy(&start_[s], &start, sizeof start);
    }
    count_ += count_ + 1 < kShifts.size() ? 1 : 0;
  }

 private:
  /// Boundaries are in units of 2^-30.
  static constexpr int kBits = 30, kDropped = kBits - kShareBits;
  static constexpr std::int32_t kOne = 1 << kBits;
  /// What learning leaves to each symbol. Rounding takes up to 2^7 of an interval, so that a share is never 0.
  static constexpr std::int32_t kLeast = (1 << kDropped) + (1 << 8);
  static constexpr std::int32_t kFree = kOne - kSymbols * kLeast;
  static constexpr std::array<std::uint8_t, 83> kShifts = [] {
    std::array<std::uint8_t, 83> shifts{};
    std::size_t n = 0;
    for (std::uint8_t shift = 1; n < shifts.size(); ++shift)
      for (; n < shifts.size() && 10 * n + 15 <= std::size_t{13} << shift; ++n) shifts[n] = shift;
    return shifts;
  }();

  static constexpr std::size_t kLanes = 4;
  using Lanes [[gnu::vector_size(16)]] = std::int32_t;

  std::array<std::int32_t, kSymbols + 1> start_;
  std::uint32_t count_ = 0;
};

/// The share of a zero of a binary decision, which is neither 0 nor everything.
[[nodiscard]] inline std::uint32_t zeroShare(const BitModel& model) {
  return std::max(model.zero() >> (BitModel::kBits - kShareBits), 1u);
}

/// Most raw bits that are coded at once.
inline constexpr int kMostRawBits = kShareBits;

/// Collects the steps of a part of a stream, and appends parts to the stream.
class SymbolWriter {
 public:
  /// \param mostSteps  number of steps of a part that there is room for
  explicit SymbolWriter(std::size_t mostSteps)
      : steps_(new std::uint32_t[mostSteps]), next_(steps_.get()) {}  // not set to 0

  bool bit(BitModel& model, bool value) {
    const std::uint32_t zero = zeroShare(model);
    put(value ? SymbolShare{zero, kWholeShare - zero} : SymbolShare{0, zero});
    model.learn(allBits(!value));
    return value;
  }
  std::uint32_t symbol(SymbolModel& model, std::uint32_t value) {
    put(model.of(value));
    model.learn(value);
    return value;
  }
  /// Codes a value of 1 to kMostRawBits bits without a model.
  std::uint32_t raw(std::uint32_t value, int bits) {
    const int rest = kShareBits - bits;
    put({value << rest, 1u << rest});
    return value;
  }

  void endPart() {
    std::uint64_t state = kFirstState;
    std::vector<std::uint32_t> words;  // from the last to the first
    while (next_ != steps_.get()) {
      const std::uint32_t step = *--next_;
      const std::uint64_t share = step & (kWholeShare - 1u), start = step >> kShareBits;
      if (state >= share << (63 - kShareBits)) {
        words.push_back(std::uint32_t(state));
        state >>= 32;
      }
      state = (state / share) << kShareBits | (state % share + start);
    }
    words.push_back(std::uint32_t(state));
    words.push_back(std::uint32_t(state >> 32));
    words_.insert(words_.end(), words.rbegin(), words.rend());
  }

  /// The bytes of all parts. Zeros at the end are left out, since a reader reads zeros there.
  [[nodiscard]] std::vector<std::byte> bytes() const {
    std::vector<std::byte> all;
    all.reserve(words_.size() * sizeof(std::uint32_t));
    for (const std::uint32_t word : words_)
      for (int shift = 0; shift < 32; shift += 8) all.push_back(std::byte(word >> shift & 0xffu));
    while (!all.empty() && all.back() == std::byte{}) all.pop_back();
    return all;
  }

 private:
  /// The state, except within a step, is from here up to 2^63 - 1.
  static constexpr std::uint64_t kFirstState = std::uint64_t{1} << 31;

  /// No symbol has everything, and raw bits are at least one, so that a share has 16 bits.
  void put(SymbolShare s) { *next_++ = s.start << kShareBits | s.share; }

  std::unique_ptr<std::uint32_t[]> steps_;
  std::uint32_t* next_;
  std::vector<std::uint32_t> words_;
};

/// Reads what a SymbolWriter wrote. The functions are inline, so that the state of a copy stays in registers.
class SymbolReader {
 public:
  explicit SymbolReader(std::span<const std::byte> bytes)
      : next_(bytes.data()), end_(bytes.data() + bytes.size()) {}

  void beginPart() {
    state_ = std::uint64_t(word()) << 32;
    state_ |= word();
  }

  [[gnu::always_inline]] bool bit(BitModel& model, bool) {
    const std::uint32_t zero = zeroShare(model), rest = kWholeShare - zero, position = place();
    const std::uint32_t isZero = allBits(position < zero);
    take({zero & ~isZero, rest ^ ((rest ^ zero) & isZero)}, position);
    model.learn(isZero);
    return isZero == 0;
  }
  [[gnu::always_inline]] std::uint32_t symbol(SymbolModel& model, std::uint32_t) {
    const std::uint32_t position = place(), value = model.at(position);
    take(model.of(value), position);
    model.learn(value);
    return value;
  }
  [[gnu::always_inline]] std::uint32_t raw(std::uint32_t, int bits) {
    const int rest = kShareBits - bits;
    const std::uint32_t position = place(), value = position >> rest;
    take({value << rest, 1u << rest}, position);
    return value;
  }

 private:
  [[nodiscard]] std::uint32_t place() const { return std::uint32_t(state_) & (kWholeShare - 1u); }
  [[gnu::always_inline]] void take(SymbolShare s, std::uint32_t position) {
    state_ = s.share * (state_ >> kShareBits) + position - s.start;
    if (state_ < std::uint64_t{1} << 31) state_ = state_ << 32 | word();
  }
  [[gnu::always_inline]] std::uint32_t word() {
    std::uint32_t result = 0;
    if (end_ - next_ < 4) [[unlikely]] {
      for (int shift = 0; next_ != end_; shift += 8) result |= std::uint32_t(*next_++) << shift;
      return result;
    }
    for (int k = 0; k < 4; ++k) result |= std::uint32_t(next_[k]) << (8 * k);
    next_ += 4;
    return result;
  }

  const std::byte *next_, *end_;
  std::uint64_t state_ = 0;
};

/// The bits that intervals take, from tables, in units of 2^-16 bits.
class BitPrices {
 public:
  static constexpr int kFractionBits = 16;

  [[nodiscard]] static std::uint32_t of(std::uint32_t share) {
    static const BitPrices prices;
    if (share < kExact) return prices.small_[share];
    const std::uint32_t rest = kWholeShare - share;
    return rest < kExact ? prices.large_[rest] : prices.medium_[share >> kDropped];
  }

 private:
  static constexpr std::uint32_t kExact =
      1024;  // this many small and large shares have an entry each
  static constexpr int kDropped = 6;

  BitPrices() {
    for (std::size_t n = 0; n < kExact; ++n) {
      small_[n] = priceOf(double(std::max<std::size_t>(n, 1)));
      medium_[n] = priceOf((double(n) + 0.5) * (1 << kDropped));
      large_[n] = priceOf(double(kWholeShare) - double(n));
    }
  }
  static std::uint32_t priceOf(double share) {
    return std::uint32_t(std::lround((kShareBits - std::log2(share)) * (1 << kFractionBits)));
  }

  std::array<std::uint32_t, kExact> small_, medium_, large_;
};

/// Measures what a writer would write. The models learn.
class SymbolMeter {
 public:
  bool bit(BitModel& model, bool value) {
    const std::uint32_t zero = zeroShare(model);
    price_ += BitPrices::of(value ? kWholeShare - zero : zero);
    model.learn(allBits(!value));
    return value;
  }
  std::uint32_t symbol(SymbolModel& model, std::uint32_t value) {
    price_ += BitPrices::of(model.of(value).share);
    model.learn(value);
    return value;
  }
  std::uint32_t raw(std::uint32_t value, int bits) {
    price_ += std::uint64_t(bits) << BitPrices::kFractionBits;
    return value;
  }
  /// A part begins with its state, half of which is information.
  void endPart() { price_ += std::uint64_t{32} << BitPrices::kFractionBits; }
  [[nodiscard]] std::uint64_t bytes() const { return price_ >> (BitPrices::kFractionBits + 3); }

 private:
  std::uint64_t price_ = 0;
};

}  // namespace esvr::codec
