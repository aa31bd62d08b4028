// Plan: frames of every form of voxels come back bit for bit, and take no more bytes than files of
// their own. Bricks appear and vanish between frames, origins and lattices change, and a frame is
// empty. Coding twice gives the same bytes. A frame that is read without its predecessor, with
// another one or with damage is refused.

#include "esvr/frame_coding.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "../fit/volumes.h"
#include "esvr/error.h"
#include "esvr/grid_coding.h"
#include "esvr/vdb_io.h"

namespace esvr {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

/// A ball that moves along z by a voxel a frame, with soft values in steps of 1/64.
SparseVolume ballAt(double frame, int bricks = 4) {
  return test::volumeOf({}, bricks, 0.0f, [&](Coord v) {
    const double x = v.x - 14.0, y = v.y - 15.0, z = v.z - 12.0 - frame;
    const double value = 1.2 - std::sqrt(x * x + y * y + z * z) / 9.0;
    return float(std::floor(std::max(value, 0.0) * 64.0) / 64.0);
  });
}

EsvrFile fileOf(const SparseVolume& volume, VoxelLayer layer) {
  GridDescriptor descriptor;
  descriptor.name = "density";
  return {{}, {makeStoredVoxels(descriptor, volume, std::move(layer))}};
}

EsvrFile boundedFile(double frame, double bound = 0.01) {
  const SparseVolume volume = ballAt(frame);
  return fileOf(volume, boundedLayer(volume, bound, Activity::kByValue));
}

void expectSame(const EsvrFile& a, const EsvrFile& b) {
  ASSERT_EQ(a.grids.size(), b.grids.size());
  EXPECT_EQ(encodeEsvr(a), encodeEsvr(b));  // the records bit for bit
  for (std::size_t g = 0; g < a.grids.size(); ++g) EXPECT_EQ(a.grids[g].voxels, b.grids[g].voxels);
}

/// Encodes and decodes a frame after another one. \return its bytes
std::vector<std::byte> expectComesBack(const EsvrFile& frame, const EsvrFile& previous) {
  auto bytes = encodeFrame(frame, &previous);
  expectSame(decodeFrame(bytes, "frame", {}, &previous), frame);
  EXPECT_LE(bytes.size(), encodeEsvr(frame).size());
  return bytes;
}

/// A layer of every form from one volume.
std::vector<VoxelLayer> layersOfAllForms(double frame) {
  const SparseVolume palette = ballAt(frame);
  SparseVolume halves = palette, floats = palette;
  test::Random random(3);
  for (float& v : halves.values) v = float(std::floor(random(0.0, 8192.0)) / 4096.0);
  for (float& v : floats.values) v += 1e-4f * v * v;
  for (float& v : floats.values) v *= 1.0f + 1e-3f * float(random(0.0, 1.0));
  return {boundedLayer(palette, 0.01, Activity::kByValue),
          boundedLayer(palette, 0.02, Activity::kExact), exactLayer(halves), exactLayer(floats),
          exactLayer(palette)};
}

TEST(FrameCoding, BringsBackEveryFormAfterEveryForm) {
  const SparseVolume volume = ballAt(1.0);
  for (const VoxelLayer& before : layersOfAllForms(0.0))
    for (const VoxelLayer& now : layersOfAllForms(1.0))
      expectComesBack(fileOf(volume, now), fileOf(volume, before));
}

TEST(FrameCoding, SavesBytesOfASlowMotion) {
  const EsvrFile previous = boundedFile(0.0), frame = boundedFile(0.1);
  const auto bytes = expectComesBack(frame, previous);
  EXPECT_TRUE(dependsOnPrevious(bytes));
  EXPECT_LT(bytes.size(), encodeEsvr(frame).size() - 56);  // less than the row that it saves
}

/// Nothing but the table, the record's place, the checksum and a few decisions for each brick is
/// left.
TEST(FrameCoding, RepeatsAnEqualFrameInFewBytes) {
  const EsvrFile frame = boundedFile(0.0);
  EXPECT_LT(expectComesBack(frame, frame).size(), 50u);
}

/// A frame with metadata, a vector and a carried grid.
EsvrFile richFile(double frame) {
  EsvrFile file = boundedFile(frame);
  for (int more = 0; more < 3; ++more) file.grids.push_back(file.grids.front());
  file.metadata = {stringItem("creator", "a program")};
  file.vectors = {{"velocity", 1}};
  CarriedGrid carried;
  carried.name = "points", carried.treeType = "Tree_ptdataidx32_5_4_3", carried.vdbVersion = 224;
  carried.bytes.resize(5000, std::byte{7});
  file.carried = {carried};
  return file;
}

TEST(FrameCoding, DoesNotRepeatWhatThePreviousFrameHas) {
  const EsvrFile previous = richFile(0.0);
  const EsvrFile frame = richFile(0.1);
  const auto bytes = encodeFrame(frame, &previous);
  const EsvrFile back = decodeFrame(bytes, "frame", {}, &previous);
  EXPECT_EQ(back.metadata, frame.metadata);
  EXPECT_EQ(back.vectors, frame.vectors);
  EXPECT_EQ(back.carried, frame.carried);
  expectSame(back, frame);
  // The four grids have the same difference, which is stored once.
  const EsvrFile alone = boundedFile(0.1), before = boundedFile(0.0);
  EXPECT_LT(bytes.size(), encodeFrame(alone, &before).size() + 50);
}

TEST(FrameCoding, StoresWhatThePreviousFrameHasNot) {
  const EsvrFile previous = richFile(0.0);
  EsvrFile frame = richFile(0.1);
  frame.metadata = {stringItem("creator", "another program")};
  frame.vectors = {{"wind", 1}};
  frame.carried.front().bytes.resize(6000, std::byte{8});
  const EsvrFile back = decodeFrame(encodeFrame(frame, &previous), "frame", {}, &previous);
  EXPECT_EQ(back.metadata, frame.metadata);
  EXPECT_EQ(back.vectors, frame.vectors);
  EXPECT_EQ(back.carried, frame.carried);
}

TEST(FrameCoding, RefusesEveryChangedBitAndEveryTruncation) {
  const EsvrFile previous = richFile(0.0);
  auto bytes = encodeFrame(richFile(0.1), &previous);
  ASSERT_TRUE(dependsOnPrevious(bytes));
  for (std::size_t at = 0; at < bytes.size(); ++at) {
    bytes[at] ^= std::byte(1 << at % 8);
    EXPECT_THROW((void)decodeFrame(bytes, "frame", {}, &previous), BadInput) << at;
    bytes[at] ^= std::byte(1 << at % 8);
    EXPECT_THROW((void)decodeFrame(std::span(bytes).first(at), "frame", {}, &previous), BadInput);
  }
}

TEST(FrameCoding, FollowsMotionsOfWholeVoxels) {
  const EsvrFile previous = boundedFile(0.0), near = boundedFile(2.0);
  const auto bytes = expectComesBack(near, previous);
  EXPECT_LT(2 * bytes.size(), encodeEsvr(near).size());
}

TEST(FrameCoding, BringsBackOtherBricksAndOrigins) {
  const SparseVolume small = ballAt(0.0, 2), large = ballAt(3.0, 4);
  SparseVolume moved = large;
  moved.origin = {-16, 8, 24};
  const auto file = [](const SparseVolume& volume) {
    return fileOf(volume, boundedLayer(volume, 0.01, Activity::kByValue));
  };
  const std::array files{file(small), file(large), file(moved)};
  for (const EsvrFile& before : files)
    for (const EsvrFile& now : files) expectComesBack(now, before);
}

TEST(FrameCoding, BringsBackAnotherLattice) {
  expectComesBack(boundedFile(0.5, 0.01), boundedFile(0.0, 0.013));
  expectComesBack(boundedFile(0.5, 0.02), boundedFile(0.0, 0.0003));
}

TEST(FrameCoding, BringsBackEmptyFrames) {
  const EsvrFile full = boundedFile(0.0), none;
  EsvrFile empty = full;
  empty.grids.front().voxels = VoxelLayer{};
  const std::array files{full, empty, none};
  for (const EsvrFile& before : files)
    for (const EsvrFile& now : files) expectComesBack(now, before);
}

TEST(FrameCoding, HasTheBytesOfAFileWithoutAPreviousFrame) {
  const EsvrFile frame = boundedFile(0.0);
  const auto bytes = encodeFrame(frame, nullptr);
  EXPECT_EQ(bytes, encodeEsvr(frame));
  EXPECT_FALSE(dependsOnPrevious(bytes));
  expectSame(decodeFrame(bytes, "frame", {}, nullptr), frame);
}

TEST(FrameCoding, FallsBackWhereThePreviousFrameHasNoVoxels) {
  const EsvrFile frame = boundedFile(0.0);
  EsvrFile previous = frame;
  previous.grids.front().voxels.reset();
  EXPECT_FALSE(dependsOnPrevious(expectComesBack(frame, previous)));
}

TEST(FrameCoding, IsDeterministic) {
  const EsvrFile previous = boundedFile(0.0), frame = boundedFile(0.7);
  EXPECT_EQ(encodeFrame(frame, &previous), encodeFrame(frame, &previous));
}

TEST(FrameCoding, CountsTheBytesOfAGrid) {
  const EsvrFile previous = boundedFile(0.0), frame = boundedFile(0.1);
  const std::uint64_t header = bytesBesideGrids({});
  EXPECT_GE(header + bytesInFrame(frame.grids[0], &previous.grids[0]),
            encodeFrame(frame, &previous).size());
  EXPECT_EQ(bytesInFrame(frame.grids[0], nullptr), bytesAdded(frame.grids[0]));
}

TEST(FrameCoding, RefusesAMissingPreviousFrame) {
  const EsvrFile previous = boundedFile(0.0), none;
  const auto bytes = encodeFrame(boundedFile(0.1), &previous);
  EXPECT_THAT([&] { (void)decodeFrame(bytes, "f.esvr, frame 2", {}, nullptr); },
              ThrowsMessage<BadInput>(
                  HasSubstr("f.esvr, frame 2: it cannot be read without the frame before")));
  EXPECT_THAT([&] { (void)decodeFrame(bytes, "f.esvr, frame 2", {}, &none); },
              ThrowsMessage<BadInput>(HasSubstr("the frame before has only 0 grids")));
}

/// With another previous frame, a reader gets other voxels or an error, but never fails otherwise.
TEST(FrameCoding, SurvivesAnotherPreviousFrame) {
  const EsvrFile previous = boundedFile(0.0), other = boundedFile(5.0, 0.5);
  const auto bytes = encodeFrame(boundedFile(0.1), &previous);
  try {
    EXPECT_EQ(decodeFrame(bytes, "frame", {}, &other).grids.size(), 1u);
  } catch (const BadInput&) {
  }
}

TEST(FrameCoding, KeepsToTheLimitOfMemory) {
  const EsvrFile frame = boundedFile(0.0);
  const auto bytes = encodeFrame(frame, &frame);
  const ReadLimits limits{.maxBytes = 16 << 10};
  EXPECT_THROW((void)decodeFrame(bytes, "frame", limits, &frame), MemoryExceeded);
}

}  // namespace
}  // namespace esvr
