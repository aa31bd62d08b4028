// Plan: whatever happens to the bytes of a file by accident, it is refused or its content is that
// of the original. Checksums cover every byte that need not be zero, so damage is found unless
// 64-bit hashes collide.
//
// Each byte of a small sequence is damaged, and the file is cut at each byte. The check must
// find every damage, and a reader must lose no frame but the damaged one and those that refer to
// it.

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "esvr/container.h"
#include "esvr/error.h"
#include "esvr/sequence_file.h"
#include "format/sample_files.h"
#include "support/temporary_folder.h"
#include "support/trials.h"

namespace esvr::test {
namespace {

using Bytes = std::vector<std::byte>;

/// A file with all kinds of sections and padding between them, small enough to damage every byte.
EsvrFile smallFile() { return everything(3); }

TEST(Damage, TruncationAtEveryByteIsRefused) {
  const Bytes whole = encodeEsvr(smallFile());
  ASSERT_FALSE(isRefused(whole));
  for (std::size_t n = 0; n < whole.size(); ++n)
    EXPECT_TRUE(isRefused({whole.begin(), whole.begin() + std::ptrdiff_t(n)})) << n;
}

TEST(Damage, SlowAnyBitFlippedIsRefused) {
  Bytes bytes = encodeEsvr(smallFile());
  // A checksum sees every bit of a section alike; the bytes before the sections have meanings of their own.
  constexpr std::size_t kHead = 256;
  for (std::size_t i = 0; i < bytes.size(); ++i)
    for (int bit = 0; bit < 8; ++bit) {
      if (i >= kHead && bit != int(i % 8)) continue;
      bytes[i] ^= std::byte(1 << bit);
      EXPECT_TRUE(isRefused(bytes)) << "byte " << i << ", bit " << bit;
      bytes[i] ^= std::byte(1 << bit);
    }
}

TEST(Damage, BytesAfterTheEndAreRefused) {
  Bytes bytes = encodeEsvr(smallFile());
  bytes.push_back({});
  EXPECT_TRUE(isRefused(bytes));
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
      EXPECT_EQ(difference(decodeEsvr(bytes, "mutated"), original), "") << i;
      ++accepted;
    } catch (const BadInput&) {
    }
  }
  EXPECT_LT(accepted, 500);  // mutations that changed nothing
}

// ---- Sequences

class SequenceDamage : public testing::Test {
 protected:
  SequenceDamage() {
    writeChains(path(), {{1, 2, 3}, {5, 6}});
    whole_ = bytesIn(path());
    frames_ = SequenceReader(path()).frames();
  }
  [[nodiscard]] std::filesystem::path path() const { return folder_ / "a.esvr"; }
  void damage(std::size_t at) const {
    Bytes bytes = whole_;
    bytes[at] ^= std::byte{0x10};
    writeBytes(path(), bytes);
  }
  /// The index of the frame that has a byte; the number of frames if none has it.
  [[nodiscard]] std::size_t frameAt(std::size_t at) const {
    const auto has = [&](const SequenceFrame& f) {
      return at >= f.offset && at < f.offset + f.bytes;
    };
    return std::size_t(std::ranges::find_if(frames_, has) - frames_.begin());
  }
  /// True if a frame cannot be read when the damaged frame is lost.
  [[nodiscard]] bool isLost(std::size_t frame, std::size_t damaged) const {
    return damaged < frames_.size() && frame >= damaged &&
           frames_[frame].group == frames_[damaged].group;
  }
  static bool canRead(SequenceReader& reader, std::int64_t number) try {
    return difference(reader.read(number), sampleFrame(number)).empty();
  } catch (const BadInput&) {
    return false;
  }

  TemporaryFolder folder_;
  Bytes whole_;
  std::vector<SequenceFrame> frames_;
};

/// True if the check finds a fault or refuses the file.
bool isFound(const std::filesystem::path& path) try {
  return !checkSequence(path).empty();
} catch (const BadInput&) {
  return true;
}

TEST_F(SequenceDamage, IsFoundAnywhere) {
  EXPECT_FALSE(isFound(path()));
  for (std::size_t at = 0; at < whole_.size(); at += stride(3)) {
    damage(at);
    EXPECT_TRUE(isFound(path())) << at;
  }
}

TEST_F(SequenceDamage, LosesNoOtherFrames) {
  const std::size_t end = frames_.back().offset + frames_.back().bytes;
  for (std::size_t at = frames_.front().offset; at < end; at += stride(3)) {
    damage(at);
    SequenceReader reader(path());
    for (std::size_t i = 0; i < frames_.size(); ++i)
      EXPECT_EQ(canRead(reader, frames_[i].number), !isLost(i, frameAt(at)))
          << "byte " << at << ", frame " << frames_[i].number;
  }
}

TEST_F(SequenceDamage, IsToldForEachFrameThatIsLost) {
  damage(frames_[1].offset + 1);
  std::vector<std::optional<std::int64_t>> lost;
  for (const SequenceFault& fault : checkSequence(path())) lost.push_back(fault.frame);
  EXPECT_EQ(lost, (std::vector<std::optional<std::int64_t>>{2, 3}));
}

TEST_F(SequenceDamage, IsTruncationAnywhere) {
  for (std::size_t n = 0; n < whole_.size(); n += 1 + (whole_.size() - 1 - n) / 16) {
    writeBytes(path(), {whole_.begin(), whole_.begin() + std::ptrdiff_t(n)});
    EXPECT_THROW(SequenceReader{path()}, BadInput) << n;
  }
}

TEST_F(SequenceDamage, OfAPartialFileRemovesTheGroupAndThoseAfterIt) {
  std::filesystem::rename(path(), folder_ / "b.esvr");
  {
    SequenceWriter writer(path());
    for (const std::int64_t number : {1, 2}) {
      writer.append(number, encodeEsvr(sampleFrame(number)));
      writer.endGroup();
    }
  }
  Bytes bytes = bytesIn(SequenceWriter::partialPath(path()));
  bytes[bytes.size() / 4] ^= std::byte{1};
  writeBytes(SequenceWriter::partialPath(path()), bytes);
  const SequenceWriter writer(path(), {.partial = PartialSequence::kResume});
  EXPECT_EQ(writer.groupCount(), 0u);
}

}  // namespace
}  // namespace esvr::test
