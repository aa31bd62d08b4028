// Plan: a file grows, is left and continued, as a process does that is killed. The target must
// appear with the whole content only, and no second writer may join.

#include "core/partial_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <atomic>
#include <fstream>
#include <functional>
#include <iterator>
#include <string>
#include <string_view>
#include <thread>

#include "esvr/error.h"
#include "support/temporary_folder.h"

namespace esvr {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::ThrowsMessage;

class PartialFileTest : public testing::Test {
 protected:
  [[nodiscard]] fs::path target() const { return folder_ / "out.esvr"; }
  void leave(std::string_view text) const {
    PartialFile file(target(), false, PartialStart::kContinue);
    file.append(std::as_bytes(std::span(text)));
  }
  [[nodiscard]] std::string content(const fs::path& path) const {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  void expectRefused(bool overwrite, PartialStart start, const char* words) const {
    EXPECT_THAT(std::function<void()>([&] { PartialFile(target(), overwrite, start); }),
                ThrowsMessage<RuntimeFailure>(HasSubstr(words)));
  }
  test::TemporaryFolder folder_;
};

TEST_F(PartialFileTest, IsContinuedUntilItIsComplete) {
  leave("one ");
  leave("two ");
  EXPECT_THAT(folder_.names(), ElementsAre("out.esvr.partial"));
  PartialFile file(target(), false, PartialStart::kContinue);
  EXPECT_EQ(file.size(), 8u);
  file.truncate(4);
  file.append(std::as_bytes(std::span(std::string_view("three"))));
  file.replaceStart(std::as_bytes(std::span(std::string_view("ONE"))));
  file.commit();
  EXPECT_THAT(folder_.names(), ElementsAre("out.esvr"));
  EXPECT_EQ(content(target()), "ONE three");
}

TEST_F(PartialFileTest, LeavesNothingWithoutContent) {
  leave("");
  EXPECT_THAT(folder_.names(), IsEmpty());
}

TEST_F(PartialFileTest, IsRefusedAsWanted) {
  leave("one");
  expectRefused(false, PartialStart::kRefuse, "out.esvr.partial");
  EXPECT_EQ(content(PartialFile::pathFor(target())), "one");
}

TEST_F(PartialFileTest, FollowsNoLinkAndOpensNoPipe) {
  const fs::path partial = PartialFile::pathFor(target());
  std::ofstream(folder_ / "other") << "other";
  fs::create_symlink(folder_ / "other", partial);
  expectRefused(true, PartialStart::kContinue, "cannot write");
  EXPECT_EQ(content(folder_ / "other"), "other");
  fs::remove(partial);
  ASSERT_EQ(::mkfifo(partial.c_str(), 0600), 0);
  expectRefused(true, PartialStart::kContinue, "not a regular file");
}

/// What another process completes between open() and lock() has the name of the target then. The
/// first process holds the lock until it has renamed the file, so that the second one waits here for
/// the lock of a file that is no longer partial.
TEST_F(PartialFileTest, DoesNotTouchWhatAnotherProcessHasJustCompletedSlow) {
  for (int round = 0; round < 200; ++round) {
    std::atomic<bool> isOpen = false;
    std::thread first([&] {
      PartialFile file(target(), true, PartialStart::kContinue);
      file.truncate(0);
      file.append(std::as_bytes(std::span(std::string_view("first"))));
      isOpen = true;
      file.commit();
    });
    while (!isOpen) std::this_thread::yield();
    for (bool isDone = false; !isDone;) try {
        PartialFile second(target(), true, PartialStart::kContinue);
        EXPECT_EQ(second.size(), 0u) << "the first process's output";
        isDone = true;
      } catch (const RuntimeFailure&) {  // the first process still has the lock
      }
    first.join();
    ASSERT_EQ(content(target()), "first");
  }
}

TEST_F(PartialFileTest, HasOneWriter) {
  const PartialFile first(target(), false, PartialStart::kRefuse);
  expectRefused(false, PartialStart::kContinue, "another process writes it");
}

TEST_F(PartialFileTest, KeepsATargetThatExists) {
  std::ofstream(target()) << "old";
  expectRefused(false, PartialStart::kContinue, "exists already");
  PartialFile file(target(), true, PartialStart::kContinue);
  file.append(std::as_bytes(std::span(std::string_view("new"))));
  EXPECT_EQ(content(target()), "old");
  file.commit();
  EXPECT_EQ(content(target()), "new");
}

TEST_F(PartialFileTest, FollowsALinkToTheTarget) {
  fs::create_directory(folder_ / "elsewhere");
  std::ofstream(folder_ / "elsewhere/real.esvr") << "old";
  fs::create_symlink(folder_ / "elsewhere/real.esvr", target());
  PartialFile file(target(), true, PartialStart::kRefuse);
  file.append(std::as_bytes(std::span(std::string_view("new"))));
  EXPECT_TRUE(fs::exists(folder_ / "elsewhere/real.esvr.partial"));
  file.commit();
  EXPECT_TRUE(fs::is_symlink(target()));
  EXPECT_EQ(content(target()), "new");
}

}  // namespace
}  // namespace esvr
