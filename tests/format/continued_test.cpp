// Plan: grids whose ellipsoids continue those of the previous frame come back, with new ellipsoids,
// with masks and in several grids. An equal frame takes a few bytes. A frame that is read without
// its predecessor, with another one or with damage is refused, or gives a valid grid.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <optional>
#include <span>

#include "codec/continued_frames.h"
#include "esvr/error.h"
#include "esvr/frame_coding.h"
#include "esvr/grid_coding.h"
#include "esvr/sequence_file.h"
#include "esvr/simplified_mask.h"
#include "fit/volumes.h"
#include "format/checksum.h"
#include "format/continued_samples.h"
#include "format/continued_section.h"
#include "format/layout.h"
#include "format/mask_section.h"
#include "format/sequence_samples.h"

namespace esvr {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

using test::frameOf;
using test::gridOf;
using test::withLevels;
using test::withMask;
using test::withNew;

constexpr std::size_t kFirstCount = 300;

EsvrFile firstFile(std::size_t count = kFirstCount) {
  return frameOf(gridOf(test::firstFrame(count)));
}

/// Most ellipsoids of the first frame, and some new ones.
EsvrFile nextFile(const EsvrFile& previous, std::size_t added = 20) {
  const QuantisedEllipsoids& before = previous.grids.front().quantised.front();
  return frameOf(gridOf(withNew(test::frameAfter(before, test::mostOf(before, 9)), added)));
}

/// The codes of ellipsoids, without what only frames have.
QuantisedEllipsoids codesOf(QuantisedEllipsoids q) {
  q.continues.clear();
  q.motion = {};
  q.layerEnds.clear();
  return q;
}

void expectSameGrid(const StoredGrid& a, const StoredGrid& b) {
  ASSERT_EQ(a.quantised.size(), 1u);
  ASSERT_EQ(b.quantised.size(), 1u);
  EXPECT_EQ(codesOf(a.quantised[0]), codesOf(b.quantised[0]));
  EXPECT_TRUE(test::sameBits(a.field, b.field));
  EXPECT_EQ(a.field.chunks[0].origin, b.field.chunks[0].origin);
  EXPECT_EQ(a.descriptor.name, b.descriptor.name);
  EXPECT_EQ(a.activeBox, b.activeBox);
  EXPECT_EQ(a.activeVoxels, b.activeVoxels);
  EXPECT_EQ(a.valueMax, b.valueMax);
  EXPECT_EQ(a.topology, b.topology);
  EXPECT_EQ(a.bricks, b.bricks);
  EXPECT_EQ(a.mask, b.mask);
}

/// Encodes and decodes a frame after another one. \return its bytes
std::vector<std::byte> expectContinues(const EsvrFile& frame, const EsvrFile& previous) {
  auto bytes = encodeFrame(frame, &previous);
  EXPECT_TRUE(dependsOnPrevious(bytes));
  EXPECT_LT(bytes.size(), encodeEsvr(frame).size());
  const EsvrFile back = decodeFrame(bytes, "frame", {}, &previous);
  EXPECT_EQ(back.grids.size(), frame.grids.size());
  for (std::size_t g = 0; g < frame.grids.size(); ++g)
    expectSameGrid(back.grids[g], frame.grids[g]);
  EXPECT_EQ(encodeFrame(back, &previous), bytes);
  return bytes;
}

TEST(ContinuedFrame, ComesBackWithNewEllipsoidsAndWithout) {
  const EsvrFile previous = firstFile();
  for (const std::size_t added : {0u, 1u, 20u, 500u}) {
    const EsvrFile frame = nextFile(previous, added);
    const auto bytes = expectContinues(frame, previous);
    const EsvrFile back = decodeFrame(bytes, "frame", {}, &previous);
    EXPECT_EQ(back.grids[0].quantised[0].continues, frame.grids[0].quantised[0].continues);
  }
}

TEST(ContinuedFrame, ComesBackAfterAContinuedFrame) {
  EsvrFile previous = firstFile();
  for (int n = 0; n < 4; ++n) {
    const auto bytes = expectContinues(nextFile(previous), previous);
    previous = decodeFrame(bytes, "frame", {}, &previous);
    EXPECT_EQ(previous.grids[0].quantised[0].motion[0].size(),
              previous.grids[0].quantised[0].continues.size());
  }
}

TEST(ContinuedFrame, ComesBackWithOtherCells) {
  const EsvrFile previous = firstFile();
  const QuantisedEllipsoids& before = previous.grids[0].quantised[0];
  (void)expectContinues(frameOf(gridOf(test::frameAfter(before, test::mostOf(before, 9), {},
                                                        test::withMovedCells(before.lattice)))),
                        previous);
}

TEST(ContinuedFrame, ComesBackWithFinerAndCoarserSteps) {
  const EsvrFile previous = firstFile();
  const QuantisedEllipsoids& before = previous.grids[0].quantised[0];
  for (const int octaves : {-2, 1, 3}) {
    const Lattice lattice = codec::refined(before.lattice, octaves);
    (void)expectContinues(
        frameOf(gridOf(test::frameAfter(before, test::mostOf(before, 9), {}, lattice))), previous);
  }
}

TEST(ContinuedFrame, ComesBackInEachOfSeveralGrids) {
  EsvrFile previous = firstFile(), frame = nextFile(previous);
  for (EsvrFile* file : {&previous, &frame})
    for (const char* name : {"thermal", "burning"}) {
      file->grids.push_back(file->grids.front());
      file->grids.back().descriptor.name = name;
    }
  const EsvrFile alone = nextFile(firstFile());
  const EsvrFile before = firstFile();
  // The ellipsoids of the three grids are equal, and their names have equal lengths, so that their
  // sections are equal and stored once.
  EXPECT_LT(expectContinues(frame, previous).size(), encodeFrame(alone, &before).size() + 50);
}

/// The same ellipsoids need no list of what they continue: a held frame. Beside the record's place,
/// the tables and a checksum, only decisions of models are left that learn that nothing changes.
TEST(ContinuedFrame, RepeatsAnEqualFrameInFewBytes) {
  const EsvrFile frame = firstFile(2000);
  const auto bytes = expectContinues(frame, frame);
  EXPECT_LT(bytes.size(), 30u + 10 * (16 + 1 + 10 * 12) / 8 + 4);
  EXPECT_LT(20 * bytes.size(), encodeEsvr(frame).size());
}

TEST(ContinuedFrame, StandsAloneInAFile) {
  const EsvrFile previous = firstFile(), frame = nextFile(previous);
  const auto bytes = encodeEsvr(frame);
  const EsvrFile back = decodeEsvr(bytes, "file");
  const QuantisedEllipsoids& q = back.grids[0].quantised[0];
  EXPECT_TRUE(q.continues.empty());
  EXPECT_EQ(q, codesOf(standingAlone(frame.grids[0].quantised[0])));
  EXPECT_EQ(encodeFrame(frame, nullptr), bytes);
  EXPECT_EQ(encodeEsvr(back), bytes);
  // The same ellipsoids in another order.
  const auto sorted = [](const Ellipsoids& e) {
    std::vector<std::array<float, 11>> rows;
    for (std::size_t i = 0; i < e.size(); ++i)
      rows.push_back({e.center[0][i], e.center[1][i], e.center[2][i], e.logScale[0][i],
                      e.logScale[1][i], e.logScale[2][i], e.rotation[0][i], e.rotation[1][i],
                      e.rotation[2][i], e.rotation[3][i], e.intensity[i]});
    std::sort(rows.begin(), rows.end());
    return rows;
  };
  EXPECT_EQ(sorted(back.grids[0].field.chunks[0].ellipsoids),
            sorted(frame.grids[0].field.chunks[0].ellipsoids));
}

TEST(ContinuedFrame, StandsAloneWhereTheLatticeOrTheOriginIsAnother) {
  const EsvrFile frame = nextFile(firstFile());
  EsvrFile otherOrigin = firstFile(), otherLattice = firstFile(), empty = firstFile();
  otherOrigin.grids[0].field.chunks[0].origin.x += 8;
  StoredGrid& grid = otherLattice.grids[0];
  grid.quantised[0].lattice.scaleStep *= 1.5;
  grid.field.chunks[0].ellipsoids = dequantise(grid.quantised[0]);
  empty.grids[0].quantised.clear();
  empty.grids[0].field.chunks.clear();
  for (const EsvrFile& previous : {otherOrigin, otherLattice, empty})
    EXPECT_FALSE(dependsOnPrevious(encodeFrame(frame, &previous)));
}

// ---- Masks

TEST(ContinuedFrame, HasAMaskAfterAMaskOrNone) {
  const EsvrFile plain = firstFile(), masked = frameOf(withMask(plain.grids[0], 0));
  const EsvrFile next = nextFile(plain), nextMasked = frameOf(withMask(next.grids[0], 1));
  (void)expectContinues(next, masked);
  const auto first = expectContinues(nextMasked, plain),
             moved = expectContinues(nextMasked, masked);
  EXPECT_LT(moved.size(), first.size());
}

TEST(ContinuedFrame, RepeatsAnEqualMaskInFewBytes) {
  const EsvrFile plain = firstFile(), masked = frameOf(withMask(plain.grids[0], 0));
  // A length, an origin, and a few decisions for each brick.
  EXPECT_LT(expectContinues(masked, masked).size(), expectContinues(plain, plain).size() + 50);
}

TEST(ContinuedFrame, HasLevelsAfterLevelsOrNone) {
  const EsvrFile plain = firstFile(), levels = frameOf(withLevels(plain.grids[0], 0));
  const EsvrFile next = nextFile(plain), nextLevels = frameOf(withLevels(next.grids[0], 1));
  (void)expectContinues(next, levels);
  (void)expectContinues(nextLevels, frameOf(withMask(plain.grids[0], 0)));
  const auto first = expectContinues(nextLevels, plain),
             second = expectContinues(nextLevels, levels);
  EXPECT_LT(second.size() + 20, first.size());
}

/// A ball as a mask of bricks, some of which may be empty.
format::Mask ballMask(Coord middle) {
  constexpr int kRadius = 9, kBricks = 4;
  format::Mask mask;
  for (int x = 0; x < kBricks; ++x)
    for (int y = 0; y < kBricks; ++y)
      for (int z = 0; z < kBricks; ++z) mask.bricks.push_back(Coord{x, y, z} * kBrickSide);
  mask.active.resize(mask.bricks.size());
  for (std::size_t b = 0; b < mask.bricks.size(); ++b)
    for (int v = 0; v < kBrickVoxels; ++v) {
      const Coord p = mask.bricks[b] + voxelLocal(v) - middle;
      if (p.x * p.x + p.y * p.y + p.z * p.z <= kRadius * kRadius) mask.active[b].set(v);
    }
  return mask;
}

TEST(MovedMask, IsThatOfABallThatHasMoved) {
  const format::Mask before = ballMask({14, 16, 16}), now = ballMask({16, 15, 16});
  const auto moved = format::movedMask(now, before);
  ASSERT_EQ(moved.size(), now.bricks.size());
  // Bricks with few voxels of the ball do not show how it moves.
  EXPECT_GT(overlapOf(moved, now.active).iou(), 0.97);
  EXPECT_LT(overlapOf(before.active, now.active).iou(), 0.85);
}

TEST(MovedMask, IsNoneForAMaskFarAway) {
  format::Mask far = ballMask({16, 16, 16});
  for (Coord& corner : far.bricks) corner.x += 1 << 30;
  EXPECT_TRUE(format::movedMask(ballMask({16, 16, 16}), far).empty());
}

TEST(MaskAfter, BringsBackMasksThatGrowShrinkAndVanish) {
  std::vector<format::Mask> masks(1);
  for (const int frame : {0, 1, 9}) {
    const StoredGrid grid = withMask({}, frame);
    masks.push_back({grid.bricks, grid.mask});
  }
  for (const format::Mask& before : masks)
    for (const format::Mask& now : masks) {
      MemoryBudget budget(kNoMemoryLimit);
      const auto bytes = format::putMaskAfter(now.bricks, now.active, before);
      const format::Mask back = format::getMaskAfter(bytes, "mask", before, budget);
      EXPECT_EQ(back.bricks, now.bricks);
      EXPECT_EQ(back.active, now.active);
    }
}

// ---- The golden sequence

/// A checksum of all codes of the ellipsoids and of the mask, which are integers.
std::uint64_t checksumOf(const StoredGrid& grid) {
  const QuantisedEllipsoids& q = grid.quantised[0];
  format::RunningChecksum sum;
  for (std::size_t a = 0; a < 3; ++a) {
    sum.add(std::as_bytes(std::span(q.position[a])));
    sum.add(std::as_bytes(std::span(q.scale[a])));
    sum.add(std::as_bytes(std::span(q.rotation[a])));
  }
  sum.add(std::as_bytes(std::span(q.precision)));
  sum.add(std::as_bytes(std::span(q.intensity)));
  sum.add(std::as_bytes(std::span(grid.mask)));
  sum.add(std::as_bytes(std::span(grid.levels)));
  return sum.value();
}

/// A sequence that was written once. It must give the same codes and bytes forever.
TEST(ContinuedFrame, HasTheCodesAndBytesOfTheGoldenSequence) {
  const auto whole = test::bytesIn(ESVR_GOLDEN_CONTINUED);
  SequenceReader reader(ESVR_GOLDEN_CONTINUED);
  ASSERT_EQ(reader.frames().size(), 6u);
  const std::array<std::uint64_t, 6> codes{9878378402168221528u, 4055967756162408075u,
                                           1176396433574993199u, 8682976545001475940u,
                                           1758888499782260259u, 5226278277942333774u};
  std::optional<EsvrFile> previous;
  for (std::size_t f = 0; f < codes.size(); ++f) {
    const auto stored =
        std::span(whole).subspan(reader.frames()[f].offset, reader.frames()[f].bytes);
    EsvrFile now = reader.read(reader.frames()[f].number);
    EXPECT_EQ(dependsOnPrevious(stored), f > 0);
    EXPECT_EQ(checksumOf(now.grids[0]), codes[f]) << f;
    EXPECT_TRUE(std::ranges::equal(encodeFrame(now, previous ? &*previous : nullptr), stored));
    previous = std::move(now);
  }
}

// ---- Refusals

TEST(ContinuedFrame, IsRefusedWithoutItsPreviousFrame) {
  const EsvrFile previous = firstFile(), none;
  const auto bytes = encodeFrame(nextFile(previous), &previous);
  EXPECT_THAT([&] { (void)decodeFrame(bytes, "f.esvr, frame 2", {}, nullptr); },
              ThrowsMessage<BadInput>(
                  HasSubstr("f.esvr, frame 2: it cannot be read without the frame before")));
  EXPECT_THAT([&] { (void)decodeFrame(bytes, "f.esvr, frame 2", {}, &none); },
              ThrowsMessage<BadInput>(HasSubstr("the frame before has only 0 grids")));
}

TEST(ContinuedFrame, IsRefusedAfterAFrameOfAnotherKind) {
  const EsvrFile previous = firstFile();
  const auto bytes = encodeFrame(nextFile(previous), &previous);
  const SparseVolume volume = test::tubeVolume();
  const EsvrFile voxels =
      frameOf(makeStoredVoxels({}, volume, boundedLayer(volume, 0.02, Activity::kByValue)));
  EsvrFile floats = previous;
  floats.grids[0].quantised.clear();
  EsvrFile twoChunks = previous;
  twoChunks.grids[0].field.chunks.push_back({{4096, 0, 0}, {}});
  twoChunks.grids[0].quantised.emplace_back();
  for (const EsvrFile& other : {voxels, floats, twoChunks})
    EXPECT_THAT([&] { (void)decodeFrame(bytes, "f.esvr", {}, &other); },
                ThrowsMessage<BadInput>(AllOf(
                    HasSubstr("f.esvr"),
                    HasSubstr("the grid of the previous frame has no ellipsoids that go on"))));
}

/// With other ellipsoids before, a reader gets other ellipsoids or an error.
TEST(ContinuedFrame, SurvivesAnotherPreviousFrame) {
  const EsvrFile previous = firstFile();
  const auto bytes = encodeFrame(nextFile(previous), &previous);
  for (const std::size_t count : {1u, 50u, 1000u}) {
    const EsvrFile other = firstFile(count);
    try {
      (void)encodeEsvr(decodeFrame(bytes, "frame", {}, &other));
    } catch (const BadInput&) {
    }
  }
}

TEST(ContinuedFrame, RefusesEveryChangedBitAndEveryTruncation) {
  const EsvrFile previous = firstFile(30);
  auto bytes = encodeFrame(frameOf(withMask(nextFile(previous).grids[0], 0)), &previous);
  ASSERT_TRUE(dependsOnPrevious(bytes));
  for (std::size_t at = 0; at < bytes.size(); ++at) {
    bytes[at] ^= std::byte(1 << at % 8);
    EXPECT_THROW((void)decodeFrame(bytes, "frame", {}, &previous), BadInput) << at;
    bytes[at] ^= std::byte(1 << at % 8);
    EXPECT_THROW((void)decodeFrame(std::span(bytes).first(at), "frame", {}, &previous), BadInput);
  }
}

/// Corrects the checksum at the end of a frame.
void correctChecksum(std::vector<std::byte>& bytes) {
  const auto content = std::span(bytes).first(bytes.size() - sizeof(std::uint64_t));
  const std::uint64_t sum = format::checksum(content);
  std::ranges::copy(std::as_bytes(std::span(&sum, 1)), bytes.end() - sizeof sum);
}

/// Changes every byte of a frame: an error, or a grid that can be written and read.
void expectSurvivesChangedBytes(const EsvrFile& frame, const EsvrFile& previous) {
  const auto whole = encodeFrame(frame, &previous);
  ASSERT_TRUE(dependsOnPrevious(whole));
  int read = 0;
  for (std::size_t at = 0; at + sizeof(std::uint64_t) < whole.size(); ++at) {
    auto bytes = whole;
    bytes[at] ^= std::byte(at % 2 ? 1 << at % 8 : 0xff);
    correctChecksum(bytes);
    try {
      const EsvrFile back = decodeFrame(bytes, "frame", {.maxBytes = 64 << 20}, &previous);
      const auto once = encodeFrame(back, &previous);
      EXPECT_EQ(encodeFrame(decodeFrame(once, "again", {}, &previous), &previous), once) << at;
      ++read;
    } catch (const BadInput&) {
    } catch (const MemoryExceeded&) {
    }
  }
  EXPECT_GT(read, 0);
}

TEST(ContinuedFrame, ReadsOrRefusesChangedBytesWithACorrectChecksum) {
  const EsvrFile plain = firstFile(15), next = nextFile(plain, 5);
  expectSurvivesChangedBytes(frameOf(withMask(next.grids[0], 1)),
                             frameOf(withMask(plain.grids[0], 0)));
  expectSurvivesChangedBytes(frameOf(withLevels(next.grids[0], 1)),
                             frameOf(withLevels(plain.grids[0], 0)));
}

TEST(ContinuedFrame, KeepsToTheLimitOfMemory) {
  const EsvrFile frame = firstFile(1000);
  const auto bytes = encodeFrame(frame, &frame);
  EXPECT_THROW((void)decodeFrame(bytes, "frame", {.maxBytes = 1000}, &frame), MemoryExceeded);
  EXPECT_NO_THROW((void)decodeFrame(bytes, "frame", {.maxBytes = 1 << 20}, &frame));
}

/// The number of new ellipsoids is at most 64 for each byte.
TEST(ContinuedSection, RefusesMoreNewEllipsoidsThanItsBytesCanHold) {
  const QuantisedEllipsoids before = test::firstFrame(10);
  const QuantisedEllipsoids now = test::frameAfter(before, test::allOf(before));
  auto bytes = format::putContinued(now, before);
  ASSERT_EQ(bytes[2], std::byte{0});  // after the octaves and the mark of cells that are the same
  const std::array<std::byte, 3> many{std::byte{0xff}, std::byte{0xff}, std::byte{0x7f}};
  bytes.erase(bytes.begin() + 2);
  bytes.insert(bytes.begin() + 2, many.begin(), many.end());
  MemoryBudget budget(kNoMemoryLimit);
  EXPECT_THAT([&] { (void)format::getContinued(bytes, "here", before, budget); },
              ThrowsMessage<BadInput>(HasSubstr("ellipsoids")));
}

}  // namespace
}  // namespace esvr
