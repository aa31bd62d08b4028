// Plan: a rank fits the parts that it is handed and gets the results of the others. It uses and fills
// a store. Ranks that do not agree end with an error. A process that was not started with others has
// no ranks.

#include "esvr/rank_workers.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <memory>

#include "distribute/fake_parts.h"
#include "esvr/error.h"
#include "support/temporary_folder.h"

namespace esvr {
namespace {

using test::FakeParts;
using test::keyOfPart;
using test::resultsOfParts;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::ThrowsMessage;

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
      all.push_back(own[n] ? *own[n] : test::resultOfPart(n));
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
  store.put(keyOfPart(2), test::resultOfPart(2));
  const FakeParts parts(5);
  EXPECT_EQ(RankWorkers(ranks, {Device{}}, &store).run(parts), resultsOfParts(5));
  EXPECT_THAT(parts.fits(), ElementsAre(1, 0, 0, 0, 1));
  EXPECT_TRUE(store.find(keyOfPart(4)).has_value());
  EXPECT_FALSE(store.find(keyOfPart(1)).has_value());
}

TEST(RankWorkers, EndWhereTheyDoNotAgree) {
  TwoRanks ranks(false);
  EXPECT_THAT([&] { (void)RankWorkers(ranks, {Device{}}, nullptr).run(FakeParts(3)); },
              ThrowsMessage<RuntimeFailure>(HasSubstr("divided the volume differently")));
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
  EXPECT_THAT(
      [] { (void)joinRanks(); },
      ThrowsMessage<RuntimeFailure>(AllOf(HasSubstr("one of 4"), HasSubstr("MPI cannot be used"))));
}

}  // namespace
}  // namespace esvr
