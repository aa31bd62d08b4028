#include "codec/range_coder.h"

#include <algorithm>
#include <array>
#include <utility>

namespace esvr::codec {
namespace {

/// Codes one byte after the other. Where the last bytes were there before, the byte that followed them then
/// is the guess for the next one, and a decision says whether it is right. A byte without a right guess is
/// coded bit by bit in the context of the byte before.
class ByteCoder {
 public:
  explicit ByteCoder(std::uint64_t count) { bytes_.reserve(count); }

  /// \param byte  what a Writer codes; a Reader ignores it \return the byte
  template <class Side>
  std::byte code(Side& side, std::byte byte) {
    const bool guesses = length_ > 0;
    const bool isRight =
        guesses && side.bit(isRight_[std::min(length_, kLongest)], byte == bytes_[from_]);
    bytes_.push_back(isRight ? bytes_[from_] : codeBits(side, byte));
    ++from_;
    length_ = isRight ? length_ + 1 : 0;
    findGuess();
    return bytes_.back();
  }

  /// The bytes so far.
  [[nodiscard]] std::vector<std::byte> take() { return std::move(bytes_); }

 private:
  /// Bytes that must be equal for a guess. Fewer find more repetitions in texts, but more wrong ones in
  /// lists of numbers of four bytes.
  static constexpr std::size_t kAlike = 5;
  static constexpr std::size_t kLongest = 15;  ///< lengths from here on have one model
  static constexpr int kPlaceBits = 16;        ///< The table of places has 2^16 rows, 512 KB.

  /// A new context knows nothing of a bit, so that the bits before in the same byte are its context then.
  template <class Side>
  std::byte codeBits(Side& side, std::byte byte) {
    auto& after = after_[std::size_t(bytes_.empty() ? std::byte{} : bytes_.back())];
    std::uint32_t node = 1;
    for (int b = 7; b >= 0; --b) {
      const bool isNew = after[node].isNew();
      const bool bit =
          side.bit(isNew ? alone_[node] : after[node], (std::uint32_t(byte) >> b & 1u) != 0);
      if (isNew) after[node].learn(allBits(!bit));
      node = node << 1 | std::uint32_t(bit);
    }
    return std::byte(node & 0xffu);
  }

  /// Remembers the place after the last bytes, and looks for an earlier one after the same bytes.
  void findGuess() {
    if (bytes_.size() < kAlike) return;
    std::uint64_t key = 0;
    for (const std::byte b : std::span(bytes_).last(kAlike)) key = key << 8 | std::uint64_t(b);
    constexpr std::uint64_t kOdd = 0x9e3779b97f4a7c15;  // 2^64 / golden ratio, which spreads keys
    std::size_t& place = places_[(key * kOdd) >> (64 - kPlaceBits)];
    if (length_ == 0 && place > 0) from_ = place, length_ = 1;
    place = bytes_.size();
  }

  std::vector<std::byte> bytes_;
  std::size_t from_ = 0;    ///< place of the guess
  std::size_t length_ = 0;  ///< 1 + right guesses in a row; 0: there is no guess
  std::vector<std::size_t> places_ = std::vector<std::size_t>(std::size_t{1} << kPlaceBits);
  /// By length. A guess is right in four of five cases at first.
  std::vector<BitModel> isRight_ = std::vector<BitModel>(kLongest + 1, BitModel(51, 1));
  std::array<BitModel, 256> alone_;  ///< by the bits before in the byte
  std::vector<std::array<BitModel, 256>> after_ = std::vector<std::array<BitModel, 256>>(256);
};

}  // namespace

std::vector<std::byte> encodeBytes(std::span<const std::byte> bytes) {
  Writer side;
  ByteCoder coder(bytes.size());
  for (const std::byte byte : bytes) coder.code(side, byte);
  return side.coder.finish();
}

std::vector<std::byte> decodeBytes(std::span<const std::byte> coded, std::uint64_t count) {
  Reader side{RangeDecoder(coded)};
  ByteCoder coder(count);
  for (std::uint64_t i = 0; i < count; ++i) coder.code(side, {});
  return coder.take();
}

}  // namespace esvr::codec
