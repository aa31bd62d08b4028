// Plan: every part is run once, and its result stands in its place, on one device and on several. Two
// devices work at the same time. An error of a part ends the run. If a device fails, the others do
// its parts, and this is told once; where none is left, the run fails. Results in a store are not
// fitted again.

#include "esvr/device_workers.h"

#include <gtest/gtest.h>

#include <atomic>
#include <barrier>
#include <string>
#include <vector>

#include "distribute/fake_parts.h"
#include "esvr/error.h"
#include "support/temporary_folder.h"

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

TEST(DeviceWorkers, FitOnlyWhatAStoreDoesNotHave) {
  const test::TemporaryFolder folder;
  PartStore store(folder / "parts", {}, PartStore::Access::kAlone);
  store.put(test::keyOfPart(1), test::resultOfPart(1));
  for (const int first : {1, 0}) {
    const test::FakeParts parts(4);
    DeviceWorkers workers(std::vector<Device>(2), {}, &store);
    EXPECT_EQ(workers.run(parts), test::resultsOfParts(4));
    EXPECT_EQ(parts.fits(), (std::vector<int>{first, 0, first, first}));
  }
}

TEST(DeviceWorkers, StoreNothingThatWasCancelled) {
  const test::TemporaryFolder folder;
  PartStore store(folder / "parts", {}, PartStore::Access::kAlone);
  test::FakeParts parts(3);
  parts.complete = false;
  DeviceWorkers workers({Device{}}, {}, &store);
  EXPECT_EQ(workers.run(parts), test::resultsOfParts(3));
  EXPECT_FALSE(store.find(test::keyOfPart(0)).has_value());
}

/// Parts of which one device can fit none.
class PartsForOthers : public test::FakeParts {
 public:
  PartsForOthers(std::size_t count, const Device& full) : FakeParts(count), full_(full) {}
  [[nodiscard]] PartOutput fit(std::size_t part, const Device& device) const override {
    if (device == full_) {
      hasFailed_ = true;
      hasFailed_.notify_all();
      throw DeviceError("it is full");
    }
    hasFailed_.wait(false);  // the others do not do all parts before it begins
    return FakeParts::fit(part, device);
  }

 private:
  Device full_;
  mutable std::atomic<bool> hasFailed_{false};
};

const Device kFirst{DeviceKind::kCuda, 0}, kSecond{DeviceKind::kCuda, 1};

TEST(DeviceWorkers, LeaveTheirPartsToTheOthersWhereOneDeviceFails) {
  for (const Device& full : {kFirst, kSecond}) {
    const PartsForOthers parts(10, full);
    std::vector<std::string> told;
    DeviceWorkers workers({kFirst, kSecond, kFirst, kSecond},
                          [&](const Device& device, const std::string& why) {
                            EXPECT_TRUE(device == full);
                            told.push_back(why);
                          });
    EXPECT_EQ(workers.run(parts), test::resultsOfParts(10));
    EXPECT_EQ(workers.run(parts), test::resultsOfParts(10));  // of the next round
    EXPECT_EQ(parts.fits(), std::vector<int>(10, 2));
    EXPECT_EQ(told, std::vector<std::string>{"it is full"});
  }
}

TEST(DeviceWorkers, FailWhereNoDeviceIsLeft) {
  const PartsForOthers parts(10, kFirst);
  DeviceWorkers workers({kFirst, kFirst});
  EXPECT_THROW((void)workers.run(parts), DeviceError);
}

}  // namespace
}  // namespace esvr
