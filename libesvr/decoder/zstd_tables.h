#pragma once
/// The tables of Zstandard's two entropy coders: finite state entropy (RFC 8878, section 4.1) and
/// Huffman's (section 4.2).

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "decoder/zstd_bits.h"

namespace esvr::decoder {

/// A decoding table of finite state entropy.
class FseTable {
 public:
  struct Limits {
    int maxLog;              ///< largest logarithm of the number of states
    std::size_t maxSymbols;  ///< largest number of symbols
  };
  FseTable() = default;
  /// \param shares  share of each symbol in 2^log states; -1: a state of its own at the end
  FseTable(std::span<const std::int16_t> shares, int log);
  /// A table that always gives the same symbol.
  explicit FseTable(std::uint8_t symbol) : states_{{symbol, 0, 0}} {}
  /// Reads the description of a table.
  static FseTable read(Bytes& in, const Limits& limits);

  [[nodiscard]] bool empty() const { return states_.empty(); }
  [[nodiscard]] int log() const { return log_; }

  /// A decoder that is in a state of the table.
  class State {
   public:
    State(const FseTable& table, BackwardBits& bits) : table_(&table) {
      state_ = bits.read(table.log());
    }
    [[nodiscard]] std::uint8_t symbol() const { return table_->states_[state_].symbol; }
    void advance(BackwardBits& bits) {
      const Entry& entry = table_->states_[state_];
      state_ = entry.base + bits.read(entry.bits);
    }

   private:
    const FseTable* table_;
    std::uint32_t state_;
  };

 private:
  struct Entry {
    std::uint8_t symbol, bits;
    std::uint16_t base;
  };
  std::vector<Entry> states_;
  int log_ = 0;
};

/// A decoding table of Huffman's codes.
class HuffmanTable {
 public:
  HuffmanTable() = default;
  static HuffmanTable read(Bytes& in);
  [[nodiscard]] bool empty() const { return entries_.empty(); }

  /// Decodes one stream, which must have as many symbols as `to`.
  void decode(std::span<const std::byte> stream, std::span<std::byte> to) const;

 private:
  struct Entry {
    std::byte symbol{};
    std::uint8_t bits = 0;
  };
  explicit HuffmanTable(std::vector<std::uint8_t> weights);

  std::vector<Entry> entries_;
  int maxBits_ = 0;
};

}  // namespace esvr::decoder
