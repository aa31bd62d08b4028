// Plan, for every generator: the bits are the same on every machine (this file has a hash of the
// volume) and for any number of threads; another seed gives another volume; the number of active
// voxels grows with the resolution as the shape requires; the smallest resolutions work.

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <bit>
#include <cmath>
#include <functional>

#include "generators/hash_noise.h"
#include "generators/paper_volumes.h"
#include "generators/shapes.h"
#include "generators/tubes.h"

namespace esvr::samples {
namespace {

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
  for (const std::size_t threads : {1u, 5u}) {
    tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    EXPECT_EQ(hashOf(make(48)), GetParam().hash);
  }
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

}  // namespace
}  // namespace esvr::samples
