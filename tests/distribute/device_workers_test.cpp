// Plan: every part is run once, and its result stands in its place, on one device and on several. Two
// devices work at the same time. An error of a part ends the run.

#include "esvr/device_workers.h"

#include <gtest/gtest.h>

#include <barrier>

#include "distribute/fake_parts.h"
#include "esvr/error.h"

namespace esvr {
namespace {

TEST(DeviceWorkers, RunEveryPartOnce) {
  for (const std::size_t devices : {1, 3}) {
    const test::FakeParts parts(10);
    DeviceWorkers workers{std::vector<Device>(devices)};
    EXPECT_EQ(workers.run(parts), test::resultsOfParts(10));
    EXPECT_EQ(parts.fits(), std::vector<int>(10, 1));
  }
}

TEST(DeviceWorkers, WorkAtTheSameTime) {
  std::barrier both(2);  // a run on one thread would not come past it
  const test::FakeParts parts(4, [&](std::size_t) { both.arrive_and_wait(); });
  DeviceWorkers workers{std::vector<Device>(2)};
  EXPECT_EQ(workers.run(parts), test::resultsOfParts(4));
}

TEST(DeviceWorkers, EndWithTheErrorOfAPart) {
  for (const std::size_t devices : {1, 2}) {
    const test::FakeParts parts(100, [](std::size_t p) {
      if (p == 3) throw DeviceError("part 3");
    });
    DeviceWorkers workers{std::vector<Device>(devices)};
    EXPECT_THROW((void)workers.run(parts), DeviceError);
    if (devices == 1) {
      EXPECT_EQ(parts.fits()[4], 0);
    }
  }
}

}  // namespace
}  // namespace esvr
