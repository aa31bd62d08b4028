// Plan: parts that are in the store are not fitted again; the others are, and are stored if they are
// complete. Two runs that share a store fit every part once, and one waits for the parts of the
// other. A merge fits nothing and says what is missing.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numeric>
#include <thread>

#include "distribute/fake_parts.h"
#include "esvr/error.h"
#include "esvr/part_store.h"
#include "support/temporary_folder.h"

namespace esvr {
namespace {

using test::FakeParts;
using test::keyOfPart;
using test::resultOfPart;
using test::resultsOfParts;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::ThrowsMessage;

class StoredPartsTest : public testing::Test {
 protected:
  [[nodiscard]] std::unique_ptr<PartStore> open() const {
    return std::make_unique<PartStore>(folder_ / "parts", std::vector<PartOrigin>{},
                                       PartStore::Access::kShared);
  }
  test::TemporaryFolder folder_;
  std::unique_ptr<PartStore> store_ = open();
  StoredPartsOptions options_{.devices = {Device{}}};
};

TEST_F(StoredPartsTest, FitsOnlyWhatIsNotThere) {
  store_->put(keyOfPart(1), resultOfPart(1));
  const FakeParts parts(4);
  EXPECT_EQ(StoredParts(*store_, options_).run(parts), resultsOfParts(4));
  EXPECT_THAT(parts.fits(), ElementsAre(1, 0, 1, 1));
  const FakeParts again(4);
  EXPECT_EQ(StoredParts(*store_, options_).run(again), resultsOfParts(4));
  EXPECT_THAT(again.fits(), ElementsAre(0, 0, 0, 0));
}

TEST_F(StoredPartsTest, KeepsNothingThatWasCancelled) {
  FakeParts parts(3);
  parts.complete = false;
  EXPECT_EQ(StoredParts(*store_, options_).run(parts), resultsOfParts(3));
  EXPECT_FALSE(store_->contains(keyOfPart(0)));
}

TEST_F(StoredPartsTest, BeginsWithItsShare) {
  std::vector<std::size_t> order;
  const FakeParts parts(8, [&](std::size_t p) { order.push_back(p); });
  options_.share = {3, 4};
  (void)StoredParts(*store_, options_).run(parts);
  EXPECT_THAT(order, ElementsAre(4, 5, 6, 7, 0, 1, 2, 3));
}

TEST_F(StoredPartsTest, ProcessesThatShareAFolderFitEveryPartOnce) {
  const FakeParts parts(
      40, [](std::size_t) { std::this_thread::sleep_for(std::chrono::milliseconds(1)); });
  std::vector<std::vector<std::vector<std::byte>>> results(3);
  {
    std::vector<std::jthread> processes;
    for (int n = 0; n < 3; ++n)
      processes.emplace_back([&, n] {
        const auto own = open();
        StoredPartsOptions options = options_;
        options.share = {n + 1, 3};
        results[std::size_t(n)] = StoredParts(*own, options).run(parts);
      });
  }
  for (const auto& result : results) EXPECT_EQ(result, resultsOfParts(40));
  EXPECT_EQ(parts.fits(), std::vector<int>(40, 1));
}

TEST_F(StoredPartsTest, TakesOverThePartOfAProcessThatHasDied) {
  { const auto claim = store_->claim(keyOfPart(0)); }  // released without a result
  const FakeParts parts(1);
  EXPECT_EQ(StoredParts(*store_, options_).run(parts), resultsOfParts(1));
}

TEST_F(StoredPartsTest, DoesNotWaitWhenCancelled) {
  const auto claim = open()->claim(keyOfPart(0));
  CancelToken cancel;
  cancel.cancel();
  options_.cancel = &cancel;
  FakeParts parts(1);
  parts.complete = false;
  EXPECT_EQ(StoredParts(*store_, options_).run(parts), resultsOfParts(1));
}

TEST_F(StoredPartsTest, AMergeSaysWhatIsMissing) {
  options_.mergeOnly = true;
  store_->put(keyOfPart(1), resultOfPart(1));
  const FakeParts parts(3);
  EXPECT_THAT([&] { (void)StoredParts(*store_, options_).run(parts); },
              ThrowsMessage<BadInput>(HasSubstr("2 of the 3 parts of round 3 are missing")));
  EXPECT_THAT(parts.fits(), ElementsAre(0, 0, 0));
}

}  // namespace
}  // namespace esvr
