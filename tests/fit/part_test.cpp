// Plan: the bytes of a part's end give the end back, and damaged bytes are refused. The key of a part
// changes with everything that the result depends on, and with nothing else.

#include "fit/chunks/part.h"

#include <gtest/gtest.h>

#include <functional>
#include <set>

#include "esvr/error.h"
#include "random_ellipsoids.h"
#include "volumes.h"

namespace esvr {
namespace {

PartEnd someEnd() {
  PartEnd end;
  end.fit = stateOf(test::randomEllipsoids(20, 1.0, 3.0));
  end.fit.adam[3].steps = 17;
  end.kernel.kappa = 3.5f;
  end.errors = {1.0, 2.0, 3.0, 4.0};
  end.pairs = 99;
  end.end = FitEnd::kTimeUp;
  end.deviceFull = true;
  end.secondsSeed = 0.25;
  return end;
}

TEST(PartBytes, GiveThePartBack) {
  const PartEnd end = someEnd(), back = partOf(bytesOf(end));
  EXPECT_EQ(back.fit.ellipsoids.size(), 20u);
  EXPECT_EQ(back.fit.ellipsoids[7].center, end.fit.ellipsoids[7].center);
  EXPECT_EQ(back.fit.adam[3].steps, 17u);
  EXPECT_EQ(back.kernel, end.kernel);
  EXPECT_EQ(back.errors.squaredSumActive, 3.0);
  EXPECT_EQ(back.end, FitEnd::kTimeUp);
  EXPECT_EQ(bytesOf(back), bytesOf(end));
}

TEST(PartBytes, AreRefusedWhereTheyAreCutOrLonger) {
  auto bytes = bytesOf(someEnd());
  for (const std::size_t size : {std::size_t{0}, std::size_t{5}, bytes.size() - 1})
    EXPECT_THROW((void)partOf(std::span(bytes).first(size)), BadInput) << size;
  bytes.push_back({});
  EXPECT_THROW((void)partOf(bytes), BadInput);
}

class PartKeys : public testing::Test {
 protected:
  /// The key after a change of the scene, the options or the start.
  struct Inputs {
    SparseVolume volume = test::tubeVolume();
    FitOptions options;
    PartStart start;
    int halo = 2;
  };
  static PartKey keyAfter(const std::function<void(Inputs&)>& change) {
    Inputs in;
    in.start.plan.start = stateOf(test::randomEllipsoids(5, 1.0, 2.0));
    in.start.ghosts = test::randomEllipsoids(3, 1.0, 2.0);
    change(in);
    const auto chunks = divideBricks(in.volume, 10);
    return keyOf(FitScene{in.volume, chunks, scaleOf(in.volume), boxOf(in.volume, std::nullopt),
                          in.halo, in.options},
                 in.start);
  }
};

TEST_F(PartKeys, ChangeWithAllThatTheResultDependsOn) {
  const std::vector<std::function<void(Inputs&)>> changes{
      [](Inputs&) {},
      [](Inputs& in) { in.volume.brickValues(0)[100] += 0.125f; },
      [](Inputs& in) { in.options.seed = 2; },
      [](Inputs& in) { in.options.device.kind = DeviceKind::kCuda; },
      [](Inputs& in) { in.options.narrowBand = true; },
      [](Inputs& in) { in.options.bothSigns = true; },
      [](Inputs& in) { in.halo = 3; },
      [](Inputs& in) { in.start.chunk = 1; },
      [](Inputs& in) { in.start.kernel.kappa = 5.0f; },
      [](Inputs& in) { in.start.plan.iterations = 7; },
      [](Inputs& in) { in.start.plan.count = 7; },
      [](Inputs& in) { in.start.plan.to = 0.5; },
      [](Inputs& in) { in.start.plan.learnKappa = true; },
      [](Inputs& in) { in.start.plan.psnr = 40.0; },
      [](Inputs& in) { in.start.plan.start.ellipsoids[2].intensity += 1.0; },
      [](Inputs& in) { in.start.plan.start.adam[2].m[0] = 1.0f; },
      [](Inputs& in) { in.start.ghosts[0].center[0] += 1.0; }};
  std::set<PartKey> keys;
  for (const auto& change : changes) EXPECT_TRUE(keys.insert(keyAfter(change)).second);
}

TEST_F(PartKeys, AreTheSameWhereTheResultIs) {
  const PartKey key = keyAfter([](Inputs&) {});
  EXPECT_EQ(keyAfter([](Inputs& in) { in.options.device.index = 3; }), key);
  EXPECT_EQ(keyAfter([](Inputs& in) { in.options.progress = [](const FitProgress&) {}; }), key);
  EXPECT_EQ(keyAfter([](Inputs& in) { in.start.pairs = 5; }), key);
}

}  // namespace
}  // namespace esvr
