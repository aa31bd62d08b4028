// Plan: every part is run once, and its result stands in its place, on one device and on several. Two
// devices work at the same time. An error of a part ends the run. If a device fails, the others do its parts,
// and this is told once; where none is left, the run fails. Results in a store are not fitted again.
//
// A rank fits the parts that it is handed and gets the results of the others. It uses and fills a store.
// Ranks that do not agree end with an error. A process that was not started with others has no ranks.
//
// A store gives back what was put, also to a later process. It refuses damaged results, another
// origin, and a process that wants it while another one uses it.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <barrier>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "esvr/error.h"
#include "esvr/fit.h"
#include "esvr/workers.h"
#include "support/files.h"
#include "support/messages.h"

namespace esvr::test {

inline PartKey keyOfPart(std::size_t part) { return {part, 7}; }

/// The result of part p is p + 1 bytes of the value p.
inline std::vector<std::byte> resultOfPart(std::size_t part) {
  return std::vector<std::byte>(part + 1, std::byte(part));
}

/// Parts that take no time.
class FakeParts : public RoundParts {
 public:
  /// \param during  is called by each fit
  explicit FakeParts(std::size_t count, std::function<void(std::size_t)> during = {})
      : fits_(count), during_(std::move(during)) {}

  [[nodiscard]] int round() const override { return 2; }
  [[nodiscard]] std::size_t count() const override { return fits_.size(); }
  [[nodiscard]] PartKey keyOf(std::size_t part) const override { return keyOfPart(part); }
  [[nodiscard]] PartOutput fit(std::size_t part, const Device&) const override {
    ++fits_[part];
    if (during_) during_(part);
    return {resultOfPart(part), complete};
  }
  /// The number of fits of each part.
  [[nodiscard]] std::vector<int> fits() const { return {fits_.begin(), fits_.end()}; }

  bool complete = true;

 private:
  mutable std::vector<std::atomic<int>> fits_;
  std::function<void(std::size_t)> during_;
};

inline std::vector<std::vector<std::byte>> resultsOfParts(std::size_t count) {
  std::vector<std::vector<std::byte>> results;
  for (std::size_t p = 0; p < count; ++p) results.push_back(resultOfPart(p));
  return results;
}

}  // namespace esvr::test

namespace esvr {
namespace {

using test::FakeParts;
using test::keyOfPart;
using test::resultOfPart;
using test::resultsOfParts;
using testing::ElementsAre;

TEST(DeviceWorkers, RunEveryPartOnce) {
  for (const std::size_t devices : {1, 3}) {
    const FakeParts parts(10);
    DeviceWorkers workers{std::vector<Device>(devices)};
    EXPECT_EQ(workers.run(parts), resultsOfParts(10));
    EXPECT_EQ(parts.fits(), std::vector<int>(10, 1));
  }
}

TEST(DeviceWorkers, WorkAtTheSameTime) {
  std::barrier both(2);  // a run on one thread would not come past it
  const FakeParts parts(4, [&](std::size_t) { both.arrive_and_wait(); });
  DeviceWorkers workers{std::vector<Device>(2)};
  EXPECT_EQ(workers.run(parts), resultsOfParts(4));
}

TEST(DeviceWorkers, EndWithTheErrorOfAPart) {
  for (const std::size_t devices : {1, 2}) {
    const FakeParts parts(100, [](std::size_t p) {
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
  store.put(keyOfPart(1), resultOfPart(1));
  for (const int first : {1, 0}) {
    const FakeParts parts(4);
    DeviceWorkers workers(std::vector<Device>(2), {}, &store);
    EXPECT_EQ(workers.run(parts), resultsOfParts(4));
    EXPECT_EQ(parts.fits(), (std::vector<int>{first, 0, first, first}));
  }
}

TEST(DeviceWorkers, StoreNothingThatWasCancelled) {
  const test::TemporaryFolder folder;
  PartStore store(folder / "parts", {}, PartStore::Access::kAlone);
  FakeParts parts(3);
  parts.complete = false;
  DeviceWorkers workers({Device{}}, {}, &store);
  EXPECT_EQ(workers.run(parts), resultsOfParts(3));
  EXPECT_FALSE(store.find(keyOfPart(0)).has_value());
}

/// Parts of which one device can fit none.
class PartsForOthers : public FakeParts {
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
    EXPECT_EQ(workers.run(parts), resultsOfParts(10));
    EXPECT_EQ(workers.run(parts), resultsOfParts(10));  // of the next round
    EXPECT_EQ(parts.fits(), std::vector<int>(10, 2));
    EXPECT_EQ(told, std::vector<std::string>{"it is full"});
  }
}

TEST(DeviceWorkers, FailWhereNoDeviceIsLeft) {
  const PartsForOthers parts(10, kFirst);
  DeviceWorkers workers({kFirst, kFirst});
  EXPECT_THROW((void)workers.run(parts), DeviceError);
}

/// Rank 0 of two. The other rank takes every second part.
class TwoRanks : public Ranks {
 public:
  explicit TwoRanks(bool agree = true) : agree_(agree) {}
  [[nodiscard]] int rank() const override { return 0; }
  [[nodiscard]] int count() const override { return 2; }
  [[nodiscard]] int rankOnHost() const override { return 0; }
  bool agree(std::uint64_t) override { return agree_; }
  void handOut(std::size_t count) override { count_ = count, next_ = 0; }
  std::optional<std::size_t> next() override {
    const std::size_t number = next_;
    next_ += 2;
    return number < count_ ? std::optional(number) : std::nullopt;
  }
  std::vector<Bytes> exchange(std::vector<std::optional<Bytes>> own) override {
    std::vector<Bytes> all;
    for (std::size_t n = 0; n < own.size(); ++n) {
      EXPECT_EQ(own[n].has_value(), n % 2 == 0);
      all.push_back(own[n] ? *own[n] : resultOfPart(n));
    }
    return all;
  }
  bool allEnd(double) override { return true; }
  void abort(int exitCode) override { std::exit(exitCode); }

 private:
  bool agree_;
  std::size_t count_ = 0, next_ = 0;
};

TEST(RankWorkers, FitTheirPartsAndGetTheOthers) {
  TwoRanks ranks;
  const FakeParts parts(5);
  EXPECT_EQ(RankWorkers(ranks, {Device{}}, nullptr).run(parts), resultsOfParts(5));
  EXPECT_THAT(parts.fits(), ElementsAre(1, 0, 1, 0, 1));
}

TEST(RankWorkers, UseAndFillAStore) {
  TwoRanks ranks;
  const test::TemporaryFolder folder;
  PartStore store(folder / "parts", {}, PartStore::Access::kShared);
  store.put(keyOfPart(2), resultOfPart(2));
  const FakeParts parts(5);
  EXPECT_EQ(RankWorkers(ranks, {Device{}}, &store).run(parts), resultsOfParts(5));
  EXPECT_THAT(parts.fits(), ElementsAre(1, 0, 0, 0, 1));
  EXPECT_TRUE(store.find(keyOfPart(4)).has_value());
  EXPECT_FALSE(store.find(keyOfPart(1)).has_value());
}

TEST(RankWorkers, EndWhereTheyDoNotAgree) {
  TwoRanks ranks(false);
  EXPECT_THAT([&] { (void)RankWorkers(ranks, {Device{}}, nullptr).run(FakeParts(3)); },
              test::ThrowsSaying<RuntimeFailure>("divided the volume differently"));
}

TEST(RankWorkers, EndWithTheErrorOfAPart) {
  TwoRanks ranks;
  const FakeParts parts(6, [](std::size_t p) {
    if (p == 2) throw DeviceError("part 2");
  });
  EXPECT_THROW((void)RankWorkers(ranks, {Device{}}, nullptr).run(parts), DeviceError);
  EXPECT_THAT(parts.fits(), ElementsAre(1, 0, 1, 0, 0, 0));
}

class StartedBy : public testing::Test {
 protected:
  void SetUp() override { clear(); }
  void TearDown() override { clear(); }
  static void clear() {
    for (const char* name :
         {"PMIX_RANK", "PMI_RANK", "OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "SLURM_STEP_NUM_TASKS"})
      ::unsetenv(name);
  }
};

TEST_F(StartedBy, AShellThereAreNoRanks) {
  EXPECT_EQ(joinRanks(), nullptr);
  ::setenv("SLURM_STEP_NUM_TASKS", "8", 1);  // a job of Slurm without MPI sets this
  EXPECT_EQ(joinRanks(), nullptr);
}

TEST_F(StartedBy, MpirunAloneThereAreNoRanks) {
  ::setenv("PMIX_RANK", "0", 1);
  ::setenv("OMPI_COMM_WORLD_SIZE", "1", 1);
  EXPECT_EQ(joinRanks(), nullptr);
}

// This program cannot find the module.
TEST_F(StartedBy, MpirunItSaysThatMpiIsMissing) {
  ::setenv("PMIX_RANK", "0", 1);
  ::setenv("OMPI_COMM_WORLD_SIZE", "4", 1);
  EXPECT_THAT([] { (void)joinRanks(); },
              test::ThrowsSaying<RuntimeFailure>("one of 4", "MPI cannot be used"));
}

}  // namespace
}  // namespace esvr

// ---- The store of results

namespace esvr {
namespace {

using Access = PartStore::Access;
using test::keyOfPart;
using test::resultOfPart;

class PartStoreTest : public testing::Test {
 protected:
  [[nodiscard]] std::string path() const { return folder_ / "parts"; }
  [[nodiscard]] std::string onlyResult() const {
    for (const auto& entry : std::filesystem::directory_iterator(path()))
      if (entry.path().extension() == ".part") return entry.path();
    return {};
  }
  std::vector<PartOrigin> origin_{{"input", "a.vdb"}, {"count", "300"}};
  test::TemporaryFolder folder_;
};

TEST_F(PartStoreTest, GivesBackWhatWasPutAlsoLater) {
  {
    PartStore store(path(), origin_, Access::kAlone);
    EXPECT_FALSE(store.find(keyOfPart(1)).has_value());
    store.put(keyOfPart(1), resultOfPart(1));
    store.put(keyOfPart(2), {});
  }
  const PartStore store(path(), origin_, Access::kAlone);
  EXPECT_EQ(store.find(keyOfPart(1)), resultOfPart(1));
  EXPECT_EQ(store.find(keyOfPart(2)), std::vector<std::byte>{});
  EXPECT_FALSE(store.find(keyOfPart(3)).has_value());
}

TEST_F(PartStoreTest, RefusesADamagedResultAndNamesIt) {
  PartStore store(path(), origin_, Access::kAlone);
  for (const auto offset : {0, 9, 17, 26}) {  // magic, size, hash and content
    store.put(keyOfPart(5), resultOfPart(5));
    std::fstream file(onlyResult(), std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(offset);
    file.put('!');
    file.close();
    EXPECT_THAT([&] { (void)store.find(keyOfPart(5)); },
                test::ThrowsSaying<BadInput>(onlyResult() + " is damaged"))
        << offset;
  }
  std::filesystem::resize_file(onlyResult(), 10);
  EXPECT_THROW((void)store.find(keyOfPart(5)), BadInput);
}

TEST_F(PartStoreTest, RefusesAnotherOriginAndNamesBoth) {
  { const PartStore store(path(), origin_, Access::kAlone); }
  const auto open = [&](std::vector<PartOrigin> origin) {
    return [this, origin] { const PartStore store(path(), origin, Access::kAlone); };
  };
  EXPECT_THAT(open({{"input", "b.vdb"}, {"count", "300"}}),
              test::ThrowsSaying<BadInput>("its input is a.vdb, not b.vdb"));
  EXPECT_THAT(open({{"input", "a.vdb"}, {"count", "30"}}),
              test::ThrowsSaying<BadInput>("its count is 300, not 30"));
  EXPECT_THAT(open({{"input", "a.vdb"}, {"count", "300"}, {"seed", "1"}}),
              test::ThrowsSaying<BadInput>("its seed is unknown"));
}

TEST_F(PartStoreTest, IsUsedByOneProcessOrSharedBySeveral) {
  const auto opening = [&](Access access) {
    return [this, access] { const PartStore store(path(), origin_, access); };
  };
  const auto inUse = test::ThrowsSaying<RuntimeFailure>("another process uses");
  {
    const PartStore store(path(), origin_, Access::kAlone);
    EXPECT_THAT(opening(Access::kAlone), inUse);
    EXPECT_THAT(opening(Access::kShared), inUse);
  }
  const PartStore store(path(), origin_, Access::kShared);
  EXPECT_NO_THROW(opening(Access::kShared)());
  EXPECT_THAT(opening(Access::kAlone), inUse);
}

TEST_F(PartStoreTest, RemovesItsFolder) {
  PartStore store(path(), origin_, Access::kAlone);
  store.put(keyOfPart(1), resultOfPart(1));
  store.remove();
  EXPECT_FALSE(std::filesystem::exists(path()));
}

TEST_F(PartStoreTest, NamesAFolderThatCannotBeMade) {
  std::ofstream(folder_ / "file") << "text";
  const std::string inFile = folder_ / "file/parts";
  EXPECT_THAT([&] { const PartStore store(inFile, origin_, Access::kAlone); },
              test::ThrowsSaying<RuntimeFailure>(inFile));
}

}  // namespace
}  // namespace esvr
