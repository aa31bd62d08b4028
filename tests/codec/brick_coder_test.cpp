// Plan: sorted keys come back from the tree of cells, in which their order takes no bits. A damaged split is refused.

#include "codec/brick_coder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "codec/range_coder.h"

namespace esvr::codec {
namespace {

std::vector<std::uint64_t> throughTheTree(std::vector<std::uint64_t> keys, int bits,
                                          std::size_t& size) {
  std::sort(keys.begin(), keys.end());
  Writer writer;
  CellTree<Writer>(writer).code(keys, bits);
  const auto bytes = writer.coder.finish();
  size = bytes.size();
  std::vector<std::uint64_t> back(keys.size());
  Reader reader{RangeDecoder(bytes)};
  CellTree<Reader>(reader).code(back, bits);
  EXPECT_EQ(back, keys);
  return back;
}

TEST(CellTree, GivesBackSortedKeys) {
  std::mt19937_64 engine(2);
  std::size_t size = 0;
  for (const int bits : {0, 3, 21, 60})
    for (const std::size_t n : {0u, 1u, 2u, 15u, 16u, 17u, 4096u}) {
      std::vector<std::uint64_t> keys(n);
      for (auto& key : keys) key = bits == 0 ? 0 : engine() >> (64 - bits);
      (void)throughTheTree(keys, bits, size);
    }
}

TEST(CellTree, PaysNothingForTheOrder) {
  std::mt19937_64 engine(3);
  std::vector<std::uint64_t> keys(4096);
  for (auto& key : keys) key = engine() >> 43;
  std::size_t size = 0;
  (void)throughTheTree(keys, 21, size);
  // log2 of the number of multisets is n (21 - log2 n + log2 e) bits; 5.4 % more are allowed.
  EXPECT_LT(double(size) * 8.0, 4096 * (21 - 12 + 1.4427) * 1.054);
}

TEST(CellTree, RefusesASplitOfMoreThanThereAre) {
  // 3 keys need numbers from 0 to 3, but the number has 4 bits, so ones are read as 15.
  RangeEncoder encoder;
  for (int i = 0; i < 200; ++i) encoder.raw(1, 1);
  const auto bytes = encoder.finish();
  std::vector<std::uint64_t> keys(3);
  Reader reader{RangeDecoder(bytes)};
  CellTree<Reader> tree(reader);
  EXPECT_THROW(tree.code(keys, 10), BadInput);
}

}  // namespace
}  // namespace esvr::codec
