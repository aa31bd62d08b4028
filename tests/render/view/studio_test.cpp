// Plan: clients that keep their messages ask for pictures. The picture of a "slow" request has so
// many samples that its last pass takes longer than all that the other client does meanwhile.

#include "render/view/studio.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <cstring>
#include <functional>
#include <future>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "render/view/outlet.h"
#include "render/view/view_client.h"

namespace esvr::view {
namespace {

using nlohmann::json;

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

}  // namespace
}  // namespace esvr::view
