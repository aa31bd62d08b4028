// Plan: clients that keep their messages ask for pictures. The picture of a "slow" request has so many samples that its
// last pass takes longer than all that the other client does meanwhile.
//
// The bytes of a message are compared with bytes written by hand; voxels with known values are counted, at the borders of
// parts of the range too.
//
// Two pictures of a few pixels are compared, and the results are known by hand. Pictures are encoded and decoded by
// libjpeg. With the best quality, smooth pictures come back within the rounding of JPEG's color transform and of its
// coefficients.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <jpeglib.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <functional>
#include <future>
#include <mutex>
#include <nlohmann/json.hpp>
#include <numeric>
#include <string>
#include <vector>

#include "esvr/error.h"
#include "render/view/desk.h"
#include "render/view/painting.h"
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

// ---- Painting

using testing::ElementsAre;

/// Four pixels in a row, whose channels have one value each.
Image row(float r, float g, float b, float a) {
  Image image{4, 1, {}};
  for (int i = 0; i < image.width; ++i) image.rgba.insert(image.rgba.end(), {r, g, b, a});
  return image;
}

class ComparisonPicture : public testing::Test {
 protected:
  [[nodiscard]] Image shown(Comparison comparison) const {
    return comparisonPicture(row(0.5f, 0.25f, 0.0f, 0.5f), row(0.25f, 0.5f, 0.0f, 1.0f),
                             comparison);
  }
};

TEST_F(ComparisonPicture, ShowsTheGridOnTheLeftOfTheSplit) {
  for (const auto& [split, pixels] :
       std::vector<std::pair<double, int>>{{0.0, 0}, {0.25, 1}, {0.5, 2}, {0.6, 2}, {1.0, 4}}) {
    const Image image = shown({{}, CompareShow::kSplit, split, 1.0});
    for (int i = 0; i < 4; ++i)
      EXPECT_EQ(image.rgba[std::size_t(4 * i)], i < pixels ? 0.5f : 0.25f) << split << ' ' << i;
  }
}

TEST_F(ComparisonPicture, ShowsTheReferenceAlone) {
  EXPECT_EQ(shown({{}, CompareShow::kReference, 0.5, 1.0}).rgba, row(0.25f, 0.5f, 0.0f, 1.0f).rgba);
}

TEST_F(ComparisonPicture, ShowsOpaqueDifferencesWithTheirGain) {
  const Image image = shown({{}, CompareShow::kDifference, 0.5, 10.0});
  EXPECT_THAT((std::vector<float>(image.rgba.begin(), image.rgba.begin() + 4)),
              ElementsAre(2.5f, 2.5f, 0.0f, 1.0f));
}

struct Decoded {
  unsigned width = 0, height = 0;
  std::vector<unsigned char> rgb;
};

Decoded decoded(const std::string& bytes) {
  jpeg_decompress_struct from{};
  jpeg_error_mgr errors{};
  from.err = jpeg_std_error(&errors);
  jpeg_create_decompress(&from);
  jpeg_mem_src(&from, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size());
  jpeg_read_header(&from, boolean(1));
  jpeg_start_decompress(&from);
  Decoded image{from.output_width, from.output_height, {}};
  image.rgb.resize(std::size_t(3) * image.width * image.height);
  while (from.output_scanline < from.output_height) {
    JSAMPROW row = &image.rgb[std::size_t(3) * image.width * from.output_scanline];
    jpeg_read_scanlines(&from, &row, 1);
  }
  jpeg_finish_decompress(&from);
  jpeg_destroy_decompress(&from);
  return image;
}

/// Half transparent red, which becomes stronger to the right.
Image redRamp(int width, int height) {
  Image image{width, height, {}};
  for (int i = 0; i < width * height; ++i)
    image.rgba.insert(image.rgba.end(), {0.5f * float(i % width) / float(width), 0.0f, 0.0f, 0.5f});
  return image;
}

TEST(JpegFile, HasThePictureInFrontOfItsBackground) {
  const Decoded image = decoded(encodeJpeg(redRamp(33, 17), {{0.0, 0.0, 1.0}, 1.0}));
  ASSERT_EQ(image.width, 33u);
  ASSERT_EQ(image.height, 17u);
  for (unsigned y = 0; y < image.height; ++y)
    for (unsigned x = 0; x < image.width; ++x) {
      const unsigned char* const pixel = &image.rgb[std::size_t(3) * (y * image.width + x)];
      EXPECT_NEAR(pixel[0], 255.0 * 0.5 * x / 33.0, 4.0) << x << ' ' << y;
      EXPECT_NEAR(pixel[1], 0.0, 4.0) << x << ' ' << y;
      EXPECT_NEAR(pixel[2], 127.5, 4.0) << x << ' ' << y;
    }
}

TEST(JpegFile, IsLargerOfBetterQuality) {
  const Image image = redRamp(64, 64);
  EXPECT_LT(encodeJpeg(image, {{}, 0.2}).size(), encodeJpeg(image, {{}, 0.95}).size());
}

TEST(JpegFile, OfAPictureBeyondLibjpegsLimitIsRefusedWithItsText) {
  const Image image{65501, 1, std::vector<float>(std::size_t(4) * 65501)};
  EXPECT_THROW((void)encodeJpeg(image, {}), RuntimeFailure);
}

}  // namespace

}  // namespace esvr::view
