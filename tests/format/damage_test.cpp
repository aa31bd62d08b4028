// Plan: whatever happens to the bytes of a file by accident, it is refused or its content is that
// of the original. Checksums cover every byte that need not be zero, so damage is found unless
// 64-bit hashes collide.

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "esvr/container.h"
#include "esvr/error.h"
#include "format/sample_files.h"

namespace esvr {
namespace {

using Bytes = std::vector<std::byte>;

bool refused(const Bytes& bytes) {
  try {
    (void)decodeEsvr(bytes, "damaged");
    return false;
  } catch (const BadInput&) {
    return true;
  }
}

/// A file with all kinds of sections and padding between them, small enough to damage every byte.
EsvrFile smallFile() { return test::everything(3); }

TEST(Damage, TruncationAtEveryByteIsRefused) {
  const Bytes whole = encodeEsvr(smallFile());
  ASSERT_FALSE(refused(whole));
  for (std::size_t n = 0; n < whole.size(); ++n)
    EXPECT_TRUE(refused({whole.begin(), whole.begin() + std::ptrdiff_t(n)})) << n;
}

TEST(Damage, SlowAnyBitFlippedIsRefused) {
  Bytes bytes = encodeEsvr(smallFile());
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    for (int bit = 0; bit < 8; ++bit) {
      bytes[i] ^= std::byte(1 << bit);
      EXPECT_TRUE(refused(bytes)) << "byte " << i << ", bit " << bit;
      bytes[i] ^= std::byte(1 << bit);
    }
  }
}

TEST(Damage, BytesAfterTheEndAreRefused) {
  Bytes bytes = encodeEsvr(smallFile());
  bytes.push_back({});
  EXPECT_TRUE(refused(bytes));
}

/// Applies one to eight of these: changes a byte, cuts a run out, repeats a run elsewhere, reverses
/// a run.
class Mutator {
 public:
  explicit Mutator(std::uint32_t seed) : pass_(seed) {}

  Bytes mutated(Bytes bytes) {
    for (std::size_t n = 1 + below(8); n > 0; --n) mutate(bytes);
    return bytes;
  }

 private:
  std::size_t below(std::size_t n) { return std::size_t(pass_()) % n; }

  void mutate(Bytes& bytes) {
    const std::size_t length = 1 + below(std::min<std::size_t>(16, bytes.size() / 2));
    const auto at = [&] { return std::ptrdiff_t(below(bytes.size() - length + 1)); };
    const auto a = bytes.begin() + at(), b = bytes.begin() + at();
    switch (below(4)) {
      case 0:
        *a = std::byte(below(256));
        break;
      case 1:
        bytes.erase(a, a + std::ptrdiff_t(length));
        break;
      case 2: {
        const Bytes run(a, a + std::ptrdiff_t(length));
        bytes.insert(b, run.begin(), run.end());
        break;
      }
      default:
        std::reverse(a, a + std::ptrdiff_t(length));
    }
  }

  std::mt19937 pass_;
};

TEST(Damage, TenThousandMutationsAreRefusedOrChangeNothing) {
  const EsvrFile original = smallFile();
  const Bytes whole = encodeEsvr(original);
  Mutator mutator(20240601);
  int accepted = 0;
  for (int i = 0; i < 10'000; ++i) {
    const Bytes bytes = mutator.mutated(whole);
    try {
      EXPECT_EQ(test::difference(decodeEsvr(bytes, "mutated"), original), "") << i;
      ++accepted;
    } catch (const BadInput&) {
    }
  }
  EXPECT_LT(accepted, 500);  // mutations that changed nothing
}

}  // namespace
}  // namespace esvr
