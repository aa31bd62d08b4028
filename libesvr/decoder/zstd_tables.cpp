#include "decoder/zstd_tables.h"

#include <cstdlib>

namespace esvr::decoder {
namespace {

constexpr int kMinLog = 5;

/// The share of a symbol in states of which some remain; -1 is a share of less than one.
int readShare(ForwardBits& in, int remaining) {
  const int bits = std::bit_width(std::uint32_t(remaining + 1));
  const int low = (1 << (bits - 1)) - 1, threshold = (1 << bits) - 1 - (remaining + 1);
  int value = int(in.read(bits));
  if ((value & low) < threshold) {
    in.back(1);
    value &= low;
  } else if (value > low) {
    value -= threshold;
  }
  return value - 1;
}

/// Appends zeros for further symbols without a share.
void readZeros(ForwardBits& in, std::vector<std::int16_t>& shares, std::size_t maxSymbols) {
  constexpr std::uint32_t kMore = 3;
  std::uint32_t zeros = kMore;
  while (zeros == kMore) {
    zeros = in.read(2);
    shares.insert(shares.end(), zeros, 0);
    require(shares.size() <= maxSymbols, "a table has too many symbols");
  }
}

/// Assigns states to the symbols. States of symbols with a share of less than one are at the end.
std::vector<std::uint8_t> spread(std::span<const std::int16_t> shares, std::size_t states) {
  std::vector<std::uint8_t> symbols(states);
  std::size_t high = states, place = 0;
  for (std::size_t s = 0; s < shares.size(); ++s)
    if (shares[s] < 0) symbols[--high] = std::uint8_t(s);
  const std::size_t step = (states >> 1) + (states >> 3) + 3;
  for (std::size_t s = 0; s < shares.size(); ++s) {
    for (int i = 0; i < shares[s]; ++i) {
      symbols[place] = std::uint8_t(s);
      do place = (place + step) & (states - 1);
      while (place >= high);
    }
  }
  require(place == 0, "the shares of a table do not fill it");
  return symbols;
}

constexpr FseTable::Limits kWeights{6, 256};
constexpr std::size_t kMaxWeights = 255;
constexpr int kMaxHuffmanBits = 11;

/// Weights that two states take turns to decode.
std::vector<std::uint8_t> readCodedWeights(std::span<const std::byte> bytes) {
  Bytes in(bytes);
  const FseTable table = FseTable::read(in, kWeights);
  BackwardBits bits(in.rest());
  FseTable::State state(table, bits), other(table, bits);
  require(bits.left() >= 0, "the weights end too early");
  std::vector<std::uint8_t> weights;
  while (weights.size() < kMaxWeights) {
    weights.push_back(state.symbol());
    state.advance(bits);
    if (bits.left() < 0) break;
    std::swap(state, other);
  }
  weights.push_back(other.symbol());
  return weights;
}

std::vector<std::uint8_t> readPlainWeights(Bytes& in, std::size_t count) {
  std::vector<std::uint8_t> weights;
  for (const std::byte pair : in.take((count + 1) / 2)) {
    weights.push_back(std::uint8_t(pair >> 4));
    weights.push_back(std::uint8_t(pair & std::byte{15}));
  }
  weights.resize(count);
  return weights;
}

/// The number of codes of the greatest length that a weight stands for.
std::uint32_t codesOf(std::uint8_t weight) {
  require(weight <= kMaxHuffmanBits, "a Huffman code is too long");
  return weight > 0 ? std::uint32_t{1} << (weight - 1) : 0;
}

}  // namespace

FseTable FseTable::read(Bytes& in, const Limits& limits) {
  ForwardBits bits(in.rest());
  const int log = kMinLog + int(bits.read(4));
  require(log <= limits.maxLog, "a table has too many states");
  std::vector<std::int16_t> shares;
  int remaining = 1 << log;
  while (remaining > 0) {
    require(shares.size() < limits.maxSymbols, "a table has too many symbols");
    const int share = readShare(bits, remaining);
    remaining -= std::abs(share);
    shares.push_back(std::int16_t(share));
    if (share == 0) readZeros(bits, shares, limits.maxSymbols);
  }
  require(remaining == 0, "the shares of a table are too large");
  (void)in.take(bits.bytesRead());
  return FseTable(shares, log);
}

FseTable::FseTable(std::span<const std::int16_t> shares, int log) : log_(log) {
  const auto states = std::uint32_t{1} << log;
  std::vector<std::uint32_t> next;
  for (const std::int16_t share : shares) next.push_back(std::uint32_t(std::abs(share)));
  for (const std::uint8_t symbol : spread(shares, states)) {
    const std::uint32_t n = next[symbol]++;
    const int bits = log - (std::bit_width(n) - 1);
    states_.push_back({symbol, std::uint8_t(bits), std::uint16_t((n << bits) - states)});
  }
}

HuffmanTable HuffmanTable::read(Bytes& in) {
  constexpr std::uint32_t kPlain = 128;  // a smaller number is a size of coded weights
  const std::uint32_t head = in.byte();
  return HuffmanTable(head < kPlain ? readCodedWeights(in.take(head))
                                    : readPlainWeights(in, head - kPlain + 1));
}

/// The last symbol has the weight that completes the codes.
HuffmanTable::HuffmanTable(std::vector<std::uint8_t> weights) {
  std::uint32_t codes = 0;
  for (const std::uint8_t weight : weights) codes += codesOf(weight);
  require(codes > 0, "there are no Huffman codes");
  maxBits_ = std::bit_width(codes);
  require(maxBits_ <= kMaxHuffmanBits, "a Huffman code is too long");
  const std::uint32_t all = std::uint32_t{1} << maxBits_, left = all - codes;
  require(std::has_single_bit(left), "the Huffman codes are not complete");
  weights.push_back(std::uint8_t(std::bit_width(left)));
  for (int weight = 1; weight <= maxBits_; ++weight)
    for (std::size_t s = 0; s < weights.size(); ++s)
      if (weights[s] == weight)
        entries_.insert(entries_.end(), codesOf(weights[s]),
                        Entry{std::byte(s), std::uint8_t(maxBits_ + 1 - weight)});
  require(entries_.size() == all, "the Huffman codes are not complete");
}

void HuffmanTable::decode(std::span<const std::byte> stream, std::span<std::byte> to) const {
  BackwardBits bits(stream);
  const auto mask = std::uint32_t(entries_.size() - 1);
  std::uint32_t state = bits.read(maxBits_);
  for (std::byte& out : to) {
    require(bits.left() > -maxBits_, "Huffman codes end too early");
    const Entry& entry = entries_[state];
    out = entry.symbol;
    state = (state << entry.bits | bits.read(entry.bits)) & mask;
  }
  require(bits.left() == -maxBits_, "there are too many Huffman codes");
}

}  // namespace esvr::decoder
