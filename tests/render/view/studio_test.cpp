// Plan: clients that keep their messages ask for pictures. The picture of a "slow" request has so many samples that its
// last pass takes longer than all that the other client does meanwhile.
//
// The bytes of a message are compared with bytes written by hand; voxels with known values are counted, at the borders of
// parts of the range too.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <cstring>
#include <functional>
#include <future>
#include <mutex>
#include <numeric>
#include <string>
#include <vector>

#include "render/view/desk.h"
#include "render/view/studio.h"
#include "render/view/view_client.h"

namespace esvr::view {
namespace {

using nlohmann::json;

// The studio.

/// A client that keeps what it is sent.
class KeptOutlet : public Outlet {
 public:
  void answer(std::string text) override { keep(json::parse(text)); }
  void deliver(std::string bytes) override {
    std::uint32_t length = 0;  // on the machines of the tests, in the order of the message
    std::memcpy(&length, bytes.data(), sizeof length);
    keep(json::parse(bytes.substr(sizeof length, length)));
  }
  [[nodiscard]] bool busy() const override {
    const std::scoped_lock lock(mutex_);
    return busy_;
  }
  void setBusy(bool busy) {
    const std::scoped_lock lock(mutex_);
    busy_ = busy;
  }

  /// The heads of all messages so far.
  [[nodiscard]] std::vector<json> heads() const {
    const std::scoped_lock lock(mutex_);
    return heads_;
  }
  /// Waits until a message is as wanted. \return false if there is none in ten seconds
  bool waitFor(const std::function<bool(const json&)>& wanted) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, std::chrono::seconds(10),
                             [&] { return std::any_of(heads_.begin(), heads_.end(), wanted); });
  }
  bool waitForPicture(int id) {
    return waitFor([id](const auto& h) { return h["type"] == "picture" && h["id"] == id; });
  }
  bool waitForLast(int id) {
    return waitFor([id](const auto& h) {
      return h["type"] == "picture" && h["id"] == id && h["last"] == true;
    });
  }

 private:
  void keep(json head) {
    {
      const std::scoped_lock lock(mutex_);
      heads_.push_back(std::move(head));
    }
    changed_.notify_all();
  }

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<json> heads_;
  bool busy_ = false;
};

DrawRequest request(int id, bool moving = false) {
  DrawRequest r;
  r.picture.id = id;
  r.picture.size = {32, 32};
  r.moving = moving;
  return r;
}

/// A picture whose last pass takes about a second.
DrawRequest slowRequest(int id) {
  DrawRequest r = request(id);
  r.picture.size = {1200, 1200};
  r.picture.scene.options.step = 0.1;
  r.picture.scene.options.opacityLength = 1e5;  // no ray ends early
  return r;
}

class StudioTest : public testing::Test {
 protected:
  static bool hasLast(const KeptOutlet& client, int id) {
    const auto heads = client.heads();
    return std::any_of(heads.begin(), heads.end(), [&](const json& head) {
      return head["id"] == id && head.value("last", false);
    });
  }

  const test::ViewFiles files_;
  const Collection collection_{{files_ / "blob.vdb"}, {}};
  const std::shared_ptr<KeptOutlet> one_ = std::make_shared<KeptOutlet>(),
                                    other_ = std::make_shared<KeptOutlet>();
  Studio studio_{collection_, {selectDevice("cpu"), {}, {}, false, {}}};
};

TEST_F(StudioTest, DrawsUntilThePictureIsComplete) {
  studio_.draw(one_, request(1));
  EXPECT_TRUE(one_->waitForLast(1));
}

TEST_F(StudioTest, ANewPictureReplacesOneThatIsRefined) {
  studio_.draw(one_, slowRequest(1));
  ASSERT_TRUE(one_->waitForPicture(1));
  studio_.draw(one_, request(2));
  ASSERT_TRUE(one_->waitForLast(2));
  EXPECT_FALSE(hasLast(*one_, 1));
}

// The first pass takes so long that a fast machine, too, shows it alone. The picture then has four
// passes, and the fourth takes seconds unless it is interrupted.
TEST_F(StudioTest, SlowRefinementsAreInterruptedByPicturesOfOthersAndGoOn) {
  DrawRequest slow = slowRequest(1);
  slow.picture.size = {400, 400};
  slow.picture.scene.options.step = 0.05;
  studio_.draw(one_, slow);
  ASSERT_TRUE(one_->waitFor([](const json& head) { return head["pass"] == 3; }));
  studio_.draw(other_, request(2, true));
  ASSERT_TRUE(other_->waitForLast(2));
  EXPECT_FALSE(hasLast(*one_, 1));
  EXPECT_TRUE(one_->waitForLast(1));
}

TEST_F(StudioTest, NoPictureIsDrawnForAClientThatHasLeft) {
  studio_.draw(one_, slowRequest(1));
  ASSERT_TRUE(one_->waitForPicture(1));
  studio_.leave(*one_);
  studio_.draw(other_, request(2));
  ASSERT_TRUE(other_->waitForLast(2));
  EXPECT_FALSE(hasLast(*one_, 1));
}

TEST_F(StudioTest, AClientThatIsBusyWaitsAndDelaysNobody) {
  one_->setBusy(true);
  studio_.draw(one_, request(1));
  studio_.draw(other_, request(2));
  ASSERT_TRUE(other_->waitForLast(2));
  EXPECT_TRUE(one_->heads().empty());
  one_->setBusy(false);
  studio_.wake();
  EXPECT_TRUE(one_->waitForLast(1));
}

TEST_F(StudioTest, OnlyTheNewestRequestOfAClientThatIsBusyIsDrawn) {
  one_->setBusy(true);
  for (int id = 1; id <= 9; ++id) studio_.draw(one_, request(id));
  one_->setBusy(false);
  studio_.wake();
  ASSERT_TRUE(one_->waitForLast(9));
  for (const json& head : one_->heads()) EXPECT_EQ(head["id"], 9);
}

TEST_F(StudioTest, ARequestThatDragsHasOnePictureEvenIfANewerOneWaits) {
  constexpr int kRequests = 20;
  for (int id = 1; id <= kRequests; ++id) studio_.draw(one_, request(id, true));
  ASSERT_TRUE(one_->waitForLast(kRequests));
  for (const json& head : one_->heads()) EXPECT_EQ(head["last"], true);
}

TEST_F(StudioTest, TasksOfAClientAreDoneInTheirOrder) {
  std::vector<int> done;
  std::promise<void> end;
  for (int i = 0; i < 5; ++i)
    studio_.add(one_, [&, i](Drawables&, Outlet&, const CancelToken&) {
      done.push_back(i);
      if (i == 4) end.set_value();
    });
  end.get_future().wait();
  EXPECT_THAT(done, testing::ElementsAre(0, 1, 2, 3, 4));
}

TEST_F(StudioTest, RefusesMoreTasksThanOneClientMayHaveWaiting) {
  one_->setBusy(true);
  const auto add = [&] { studio_.add(one_, [](Drawables&, Outlet&, const CancelToken&) {}); };
  for (int i = 0; i < 8; ++i) add();
  EXPECT_THROW(add(), BadInput);
}

TEST_F(StudioTest, TellsAClientWhatFailed) {
  DrawRequest wrong = request(3);
  wrong.picture.scene.options.camera.eye = Vec3{1, 1, 1};
  wrong.picture.scene.options.camera.center = Vec3{1, 1, 1};
  studio_.draw(one_, wrong);
  EXPECT_TRUE(one_->waitFor([](const json& h) { return h["type"] == "failed" && h["id"] == 3; }));
}

TEST_F(StudioTest, StopsInTheMiddleOfAPicture) {
  studio_.draw(one_, slowRequest(1));
  ASSERT_TRUE(one_->waitForPicture(1));
  studio_.stop();
  EXPECT_FALSE(hasLast(*one_, 1));
  studio_.draw(one_, request(2));  // has no effect
}

// The desk.

using namespace std::string_literals;

// Messages.

TEST(BinaryMessage, HasItsHeadBetweenTheLengthAndTheBytes) {
  EXPECT_EQ(binaryMessage({{"id", 1}}, "\0xyz"s), "\x08\0\0\0{\"id\":1}\0xyz"s);
}

TEST(BinaryMessage, HasALengthOfSeveralBytes) {
  const std::string message = binaryMessage({{"x", std::string(0x12345, 'x')}}, "");
  EXPECT_EQ(message.substr(0, 4), "\x4d\x23\x01\0"s);  // 0x12345 and the 8 bytes {"x":""}
}

TEST(JsonText, ReplacesBytesThatAreNotUtf8) {
  EXPECT_EQ(textOf({{"name", "a\xff"}}), "{\"name\":\"a\xef\xbf\xbd\"}");
}

// Histograms.

/// A brick with these active values.
SparseVolume volumeOf(const std::vector<float>& values) {
  BrickInput brick;
  for (std::size_t i = 0; i < values.size(); ++i) {
    brick.values[i] = values[i];
    brick.active.set(int(i));
  }
  return makeVolume({brick}, 0.0f);
}

// The width of a part is 1, so that the borders are whole numbers and exact.
TEST(Histogram, CountsTheActiveValuesOfEachPart) {
  const auto counts =
      histogramOf(volumeOf({0.0f, 0.5f, 1.0f, 1.999f, 128.0f, 255.5f, 256.0f}), {0.0f, 256.0f});
  ASSERT_EQ(counts.size(), 256u);
  EXPECT_EQ(counts[0], 2u);
  EXPECT_EQ(counts[1], 2u);
  EXPECT_EQ(counts[128], 1u);
  EXPECT_EQ(counts[255], 2u);
  EXPECT_EQ(std::accumulate(counts.begin(), counts.end(), std::uint64_t{0}), 7u);
}

TEST(Histogram, CountsValuesOutsideTheRangeAtItsEnds) {
  const auto counts = histogramOf(volumeOf({-1e30f, 1e30f}), {0.0f, 1.0f});
  EXPECT_EQ(counts.front(), 1u);
  EXPECT_EQ(counts.back(), 1u);
}

TEST(Histogram, CountsAllValuesOnceIfTheyAreEqual) {
  EXPECT_EQ(histogramOf(volumeOf({3.0f, 3.0f}), {3.0f, 3.0f}).front(), 2u);
}

TEST(HistogramMessage, NamesItsPlace) {
  const auto content = nlohmann::json::parse(histogramMessage({2, 1, 7}, {0.5f, 2.0f}, {3, 4}));
  EXPECT_EQ(content, nlohmann::json::parse(R"({"type":"histogram","file":2,"grid":1,"frame":7,
      "histogram":{"low":0.5,"high":2.0,"counts":[3,4]}})"));
}

}  // namespace
}  // namespace esvr::view
