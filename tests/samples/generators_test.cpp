// Plan: the distance to a round cone agrees with a search over its balls. Soft edges and the scale of a set of tubes are
// checked, too. The octree search agrees with a plain visit of every voxel, for every kind of shape, and keeps its limits.
//
// For every generator, the bits are the same on every machine (this file has a hash of the volume) and for any number of
// threads; another seed gives another volume; the number of active voxels grows with the resolution as the shape requires;
// the smallest resolutions work. Every kind has grids that can be written, with the right names, classes and metadata.
//
// SWC text becomes a skeleton, every wrong line is refused with its number, and the tubes and
// pieces of a skeleton are right.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>
#include <limits>
#include <set>
#include <sstream>

#include "esvr/error.h"
#include "generators/sample_kinds.h"
#include "generators/shapes.h"
#include "generators/tubes.h"
#include "generators/voxelise.h"
#include "support/machine.h"
#include "support/messages.h"

namespace esvr::samples {
namespace {

// Shapes.

/// The minimum over the balls of a tube, on a fine grid along its axis.
double searchedDistance(const Tube& tube, Vec3 p) {
  constexpr int kBalls = 20'000;
  double nearest = std::numeric_limits<double>::infinity();
  for (int i = 0; i <= kBalls; ++i) {
    const double t = double(i) / kBalls;
    const double radius = tube.radiusA + (tube.radiusB - tube.radiusA) * t;
    nearest = std::min(nearest, length(p - (tube.a + (tube.b - tube.a) * t)) - radius);
  }
  return nearest;
}

TEST(SignedDistance, isTheMinimumOverTheBalls) {
  Random random(1);
  for (int i = 0; i < 60; ++i) {
    const Tube tube{random.inCube(-2.0, 2.0), random.inCube(-2.0, 2.0), random.uniform(0.0, 2.0),
                    random.uniform(0.0, 2.0)};
    const Vec3 p = random.inCube(-4.0, 4.0);
    // The error of the search is of second order in its step: (7 / 20000)^2 over distances >= 1e-3.
    EXPECT_NEAR(signedDistance(tube, p), searchedDistance(tube, p), 2e-4) << "tube " << i;
  }
}

TEST(SignedDistance, ofATubeWithoutLengthIsThatOfTheLargerBall) {
  const Tube tube{{1.0, 0.0, 0.0}, {1.0, 0.0, 0.0}, 0.5, 0.25};
  EXPECT_DOUBLE_EQ(signedDistance(tube, {3.0, 0.0, 0.0}), 1.5);
  EXPECT_DOUBLE_EQ(signedDistance({tube.b, tube.a, 0.25, 0.5}, {3.0, 0.0, 0.0}), 1.5);
}

TEST(VoxeliseTubes, fadesOverTheEdgeAcrossTheSurface) {
  const Tube tube{{20.0, 20.0, 0.0}, {20.0, 20.0, 40.0}, 5.0, 5.0};
  const SparseVolume volume = voxeliseTubes(std::vector{tube}, 2.0, {});
  EXPECT_EQ(valueAt(volume, {20, 20, 20}), 1.0f);
  EXPECT_EQ(valueAt(volume, {24, 20, 20}), 1.0f);  // distance -1, which is half the edge
  EXPECT_EQ(valueAt(volume, {25, 20, 20}), 0.5f);
  EXPECT_EQ(valueAt(volume, {26, 20, 20}), 0.0f);
  EXPECT_EQ(activeBox(volume), (Box{{15, 15, -5}, {25, 25, 45}}));
}

TEST(FitTubes, givesTheLongestSideTheResolution) {
  const std::vector<Tube> tubes{{{100.0, 5.0, 5.0}, {150.0, 5.0, 5.0}, 5.0, 5.0}};
  const auto scaled = fitTubes(tubes, {.resolution = 120, .minRadius = 0.75, .margin = 1});
  EXPECT_DOUBLE_EQ(scaled.voxelSize, 0.5);
  const Tube& tube = scaled.tubes.front();
  EXPECT_DOUBLE_EQ(tube.radiusA, 10.0);
  // The surface begins at the lower face of voxel 1, which is at 0.5.
  EXPECT_DOUBLE_EQ(tube.a.x - tube.radiusA, 0.5);
  EXPECT_DOUBLE_EQ(scaled.origin.x + tube.a.x * scaled.voxelSize, 100.0);
}

TEST(FitTubes, thickensWhatIsThinnerThanTheMinimum) {
  const std::vector<Tube> tubes{{{0.0, 0.0, 0.0}, {100.0, 0.0, 0.0}, 0.0, 0.01}};
  const auto scaled = fitTubes(tubes, {.resolution = 50, .minRadius = 0.75});
  EXPECT_EQ(scaled.tubes.front().radiusA, 0.75);
  EXPECT_EQ(scaled.tubes.front().radiusB, 0.75);
}

TEST(FitTubes, refusesTubesWithoutExtent) {
  const std::vector<Tube> tubes{{{1.0, 2.0, 3.0}, {1.0, 2.0, 3.0}, 0.0, 0.0}};
  EXPECT_THROW((void)fitTubes(tubes, {}), BadInput);
}

template <class S>
void expectSameAsPlainVisit(const S& shape, const SparseVolume& volume, const Box& box) {
  std::uint64_t active = 0;
  for (int x = box.min.x; x <= box.max.x; ++x)
    for (int y = box.min.y; y <= box.max.y; ++y)
      for (int z = box.min.z; z <= box.max.z; ++z) {
        const Sample sample = shape.at({double(x), double(y), double(z)});
        if (!sample.active) continue;
        ++active;
        ASSERT_EQ(valueAt(volume, {x, y, z}), sample.value) << toString(Coord{x, y, z});
      }
  EXPECT_EQ(activeVoxelCount(volume), active);
  EXPECT_NO_THROW(checkInvariants(volume));
}

template <class S>
void searchAndCompare(const S& shape, const Box& box, float background = 0.0f) {
  const SparseVolume volume = voxelise(shape, {.box = box, .background = background});
  expectSameAsPlainVisit(shape, volume, box);
}

TEST(Voxelise, findsEveryVoxelOfTubes) {
  auto tubes = treeTubes({.resolution = 200, .seed = 2});
  tubes.resize(40);  // the plain visit tests every tube at every voxel
  searchAndCompare(TubeShape(tubes, 2.0), boundsOf(tubes, 2.0));
}

TEST(Voxelise, findsEveryVoxelOfAPlume) {
  for (const int resolution : {9, 64})
    searchAndCompare(PlumeShape(3, resolution),
                     Box{{0, 0, 0}, {resolution - 1, resolution - 1, resolution - 1}});
}

TEST(Voxelise, findsEveryVoxelOfBlobsAtNegativeCoordinates) {
  const std::vector<Blob> blobs{{{-20.0, 3.0, -7.5}, 9.0, 1.0}, {{5.0, 6.0, 7.0}, 4.0, 0.5}};
  searchAndCompare(BlobShape(blobs, 0.25f), Box{{-30, -7, -17}, {10, 13, 12}}, 0.25f);
}

TEST(Voxelise, findsEveryVoxelOfALevelSet) {
  searchAndCompare(LevelSetShape(40, 0.1), Box{{-4, -4, -4}, {44, 44, 44}}, 0.3f);
}

TEST(Voxelise, ofAnEmptyShapeHasNoBrick) {
  const std::vector<Blob> blobs{{{500.0, 0.0, 0.0}, 4.0, 1.0}};
  const auto volume =
      voxelise(BlobShape(blobs, 0.5f), {.box = {{0, 0, 0}, {9, 9, 9}}, .background = 0.5f});
  EXPECT_EQ(volume.brickCount(), 0u);
  EXPECT_EQ(volume.background, 0.5f);
}

TEST(Voxelise, givesUpBeyondTheBricksAllowed) {
  EXPECT_THROW((void)makeBlobs({.resolution = 64, .limits = {.maxBricks = 10}}), DeviceError);
}

TEST(Voxelise, stopsWhenCancelled) {
  CancelToken token;
  token.cancel();
  EXPECT_THROW((void)makeBlobs({.resolution = 64, .limits = {.cancel = &token}}), Cancelled);
}

// Generators.

class Hasher {
 public:
  void add(std::uint64_t word) { state_ = hash(state_, word); }
  void add(Coord c) {
    add(std::uint32_t(c.x));
    add(std::uint32_t(c.y));
    add(std::uint32_t(c.z));
  }
  void add(float value) { add(std::bit_cast<std::uint32_t>(value)); }
  [[nodiscard]] std::uint64_t state() const { return state_; }

 private:
  void add(std::uint32_t word) { add(std::uint64_t{word}); }
  std::uint64_t state_ = 0;
};

/// A hash of everything in a volume: bricks, values bit by bit, active masks, origin and
/// background.
std::uint64_t hashOf(const SparseVolume& volume) {
  Hasher hasher;
  hasher.add(volume.origin);
  hasher.add(volume.background);
  for (const Coord brick : volume.bricks) hasher.add(brick);
  for (const float value : volume.values) hasher.add(value);
  for (const BrickMask& mask : volume.active)
    for (const std::uint64_t word : mask.words) hasher.add(word);
  return hasher.state();
}

struct Generator {
  const char* name;
  std::function<SparseVolume(const SampleOptions&)> make;
  std::uint64_t hash;  ///< hash at resolution 48 with seed 1
  bool seeded;
  double dimension;  ///< voxels grow as resolution^dimension: 3 for solids, 2 for surfaces, less
                     ///< where thin parts are thickened to a voxel
};

void PrintTo(const Generator& generator, std::ostream* out) { *out << generator.name; }

class Generators : public testing::TestWithParam<Generator> {
 protected:
  static SparseVolume make(int resolution, std::uint64_t seed = 1) {
    return GetParam().make({.resolution = resolution, .seed = seed});
  }
};

TEST_P(Generators, haveTheSameBitsOnEveryMachineForAnyNumberOfThreads) {
  for (const std::size_t threads : {1, 5})
    EXPECT_EQ(test::onThreads(threads, [] { return hashOf(make(48)); }), GetParam().hash);
}

TEST_P(Generators, dependOnTheSeedWhereTheyHaveNoise) {
  EXPECT_EQ(hashOf(make(48, 2)) != GetParam().hash, GetParam().seeded);
}

TEST_P(Generators, growWithTheResolution) {
  const auto coarse = double(activeVoxelCount(make(64)));
  const auto fine = double(activeVoxelCount(make(128)));
  const double exponent = std::log2(fine / coarse);
  EXPECT_NEAR(exponent, GetParam().dimension, 0.45);  // soft edges bend the law
}

TEST_P(Generators, holdVoxelsAtTheSmallestResolutions) {
  for (const int resolution : {1, 2, 3}) {
    const SparseVolume volume = make(resolution);
    EXPECT_GT(activeVoxelCount(volume), 0u) << resolution;
    EXPECT_NO_THROW(checkInvariants(volume));
  }
}

INSTANTIATE_TEST_SUITE_P(
    All, Generators,
    testing::Values(Generator{"tree", makeTree, 0xb75be11f7a1dead3u, true, 1.5},
                    Generator{"plume", makePlume, 0x55e2447175ea6871u, true, 3},
                    Generator{"blobs", [](const SampleOptions& o) { return makeBlobs(o); },
                              0x4331649967eb72e5u, true, 3},
                    Generator{"levelset",
                              [](const SampleOptions& o) { return makeLevelSet(o, 0.5); },
                              0x275bd22e35e0af72u, false, 2},
                    Generator{"8area", makeEightAreas, 0xe55873986a4b2b58u, true, 3},
                    Generator{"empty-sphere", makeEmptySphere, 0x61a042dea231c157u, false, 2.5},
                    Generator{"synth-tube", makeSynthTube, 0x9ba9f78ceb153eu, false, 2.5},
                    Generator{"synth-wiggle", makeSynthWiggle, 0x8182b920e2d21bc4u, false, 2},
                    Generator{"diffuse-scalar", makeDiffuseScalar, 0x16f08d87b61c310cu, false, 3}),
    [](const auto& instance) {
      std::string name = instance.param.name;
      std::erase(name, '-');
      return name;
    });

const GridDescriptor& descriptor(const SampleFile& file, std::size_t i) {
  return file.grids.at(i).descriptor;
}

TEST(SampleKinds, haveNamesOfTheirOwnAndActiveVoxels) {
  std::set<std::string> names;
  for (const SampleKind& kind : sampleKinds()) {
    EXPECT_TRUE(names.insert(kind.name).second);
    const SampleFile file = kind.make({.resolution = 16});
    ASSERT_FALSE(file.grids.empty()) << kind.name;
    for (const VolumeGrid& grid : file.grids) {
      EXPECT_GT(activeVoxelCount(grid.volume), 0u) << kind.name;
      EXPECT_EQ(grid.descriptor.background, double(grid.volume.background)) << kind.name;
      EXPECT_FALSE(grid.descriptor.transform.mapType.empty()) << kind.name;
    }
  }
}

TEST(SampleKind, listsTheNamesForAnUnknownOne) {
  EXPECT_EQ(sampleKind("plume").name, std::string("plume"));
  EXPECT_THAT([] { (void)sampleKind("smoke"); },
              test::ThrowsSaying<UsageError>("tree, plume, blobs"));
}

TEST(SampleKinds, areOneSizeInWorldSpaceWhateverTheResolution) {
  for (const int resolution : {16, 64}) {
    const SampleFile file = sampleKind("tree").make({.resolution = resolution});
    EXPECT_DOUBLE_EQ((*descriptor(file, 0).transform.affine)[0] * resolution, kWorldSize);
  }
}

TEST(SampleKinds, levelsetIsALevelSetOfHalfWidthThree) {
  const SampleFile file = sampleKind("levelset").make({.resolution = 32});
  EXPECT_EQ(descriptor(file, 0).gridClass, GridClass::kLevelSet);
  EXPECT_FLOAT_EQ(float(descriptor(file, 0).background), 30.0f / 32.0f);
}

TEST(SampleKinds, twoGridsDifferInEverythingAConverterMayLose) {
  const SampleFile file = sampleKind("two-grids").make({.resolution = 16});
  ASSERT_EQ(file.grids.size(), 2u);
  EXPECT_EQ(descriptor(file, 0).name, "density");
  EXPECT_EQ(descriptor(file, 0).valueType, ValueType::kHalf);
  EXPECT_EQ(descriptor(file, 0).metadata.size(), 2u);
  EXPECT_EQ(descriptor(file, 1).name, "temperature");
  EXPECT_EQ(descriptor(file, 1).background, 0.25);
  EXPECT_NE(descriptor(file, 0).transform, descriptor(file, 1).transform);
  EXPECT_NE((*descriptor(file, 0).transform.affine)[1], 0.0) << "rotated";
  EXPECT_EQ(file.metadata.front().name, "creator");
}

// ---- Skeletons

Skeleton parse(const std::string& text) {
  std::istringstream stream(text);
  return parseSwc(stream, "test.swc");
}

TEST(ParseSwc, readsNodesAmongCommentsBlanksAndCarriageReturns) {
  const auto s = parse("# made by hand\r\n\n 1 1 0 0 0 2.5 -1 # soma\n2\t3 +1.5 -2e1 .5 0 1\r\n");
  ASSERT_EQ(s.size(), 2u);
  EXPECT_EQ(s[0].radius, 2.5);
  EXPECT_FALSE(s[0].parent.has_value());
  EXPECT_EQ(s[1].position.y, -20.0);
  EXPECT_EQ(s[1].parent, 0u);
}

TEST(ParseSwc, takesParentsThatComeLater) {
  const auto s = parse("7 0 0 0 0 1 9\n9 0 1 0 0 1 -1\n");
  EXPECT_EQ(s[0].parent, 1u);
}

TEST(ParseSwc, ignoresColumnsBeyondTheSeventh) {
  EXPECT_EQ(parse("1 0 0 0 0 1 -1 extra 5\n").size(), 1u);
}

struct BadSwc {
  const char* text;
  const char* line;
  const char* reason;
};

class RefusedSwc : public testing::TestWithParam<BadSwc> {};

TEST_P(RefusedSwc, namesFileLineAndReason) {
  EXPECT_THAT([] { (void)parse(GetParam().text); },
              test::ThrowsSaying<BadInput>("test.swc", GetParam().line, GetParam().reason));
}

INSTANTIATE_TEST_SUITE_P(
    All, RefusedSwc,
    testing::Values(BadSwc{"", "", "no node"}, BadSwc{"# nothing\n", "", "no node"},
                    BadSwc{"1 0 0 0 0 1\n", "line 1", "7 columns, but the line has 6"},
                    BadSwc{"#\n1 0 zero 0 0 1 -1\n", "line 2", "'zero'"},
                    BadSwc{"1 0 0 0 0 nan -1\n", "line 1", "not finite"},
                    BadSwc{"1 0 0 inf 0 1 -1\n", "line 1", "not finite"},
                    BadSwc{"1 0 0 0 1e999 1 -1\n", "line 1", "1e999"},
                    BadSwc{"1 0 0 0 0 -2 -1\n", "line 1", "radius is negative"},
                    BadSwc{"1.5 0 0 0 0 1 -1\n", "line 1", "'1.5'"},
                    BadSwc{"-4 0 0 0 0 1 -1\n", "line 1", "id is negative"},
                    BadSwc{"1 0 0 0 0 1 -1\n1 0 1 0 0 1 -1\n", "line 2", "defined twice"},
                    BadSwc{"1 0 0 0 0 1 1\n", "line 1", "its own parent"},
                    BadSwc{"1 0 0 0 0 1 -1\n2 0 1 0 0 1 5\n", "line 2", "parent 5 does not exist"},
                    BadSwc{"\x7f"
                           "ELF\x02\x01 binary\n",
                           "line 1", "7 columns"}));

TEST(TubesOf, linkEveryNodeToItsParentAndKeepLonelyNodesAsBalls) {
  const auto tubes =
      tubesOf(parse("1 0 0 0 0 3 -1\n2 0 5 0 0 1 1\n3 0 5 5 0 1 2\n4 0 9 9 9 2 -1\n"));
  ASSERT_EQ(tubes.size(), 3u);
  EXPECT_EQ(tubes[0].a.x, 5.0);
  EXPECT_EQ(tubes[0].b.x, 0.0);
  EXPECT_EQ(tubes[0].radiusA, 1.0);
  EXPECT_EQ(tubes[0].radiusB, 3.0);
  EXPECT_EQ(tubes[2].a.z, 9.0);
  EXPECT_EQ(tubes[2].b.z, 9.0);
}

TEST(LongestPieces, keepsThePiecesOfLongestCable) {
  // The pieces have lengths of 1 (nodes 1, 2), 3 (10, 11, 12) and 0 (20), in mixed order.
  const auto s = parse(
      "1 0 0 0 0 1 -1\n11 0 2 0 0 1 10\n2 0 1 0 0 1 1\n10 0 0 0 0 1 -1\n12 0 2 1 0 1 11\n"
      "20 0 7 7 7 1 -1\n");
  const auto longest = longestPieces(s, 1);
  ASSERT_EQ(longest.size(), 3u);
  EXPECT_EQ(longest[0].position.x, 2.0);
  EXPECT_EQ(longest[0].parent, 1u) << "parents are renumbered";
  EXPECT_FALSE(longest[1].parent.has_value());
  EXPECT_EQ(longest[2].parent, 0u);
  EXPECT_EQ(longestPieces(s, 2).size(), 5u);
  EXPECT_EQ(longestPieces(s, 99).size(), 6u);
}

}  // namespace

}  // namespace esvr::samples
