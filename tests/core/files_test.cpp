// Plan: a file appears under its name with its whole content only, or not at all: without a commit, on a
// full disk, and after a process was killed. Permissions, links and the files of others are kept.
// A partial file grows, is left and continued, as a process does that is killed. The target must
// appear with the whole content only, and no second writer may join.
//
// Texts are read from files and from pipes, with and without a program that writes to them.
// Watched files are replaced, changed and removed.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <fstream>
#include <functional>
#include <iterator>
#include <string>
#include <string_view>
#include <thread>

#include "core/atomic_file.h"
#include "core/read_input.h"
#include "esvr/error.h"
#include "support/files.h"
#include "support/messages.h"

namespace esvr {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::IsEmpty;

class AtomicFileTest : public testing::Test {
 protected:
  [[nodiscard]] fs::path target() const { return folder_ / "out.esvr"; }
  [[nodiscard]] std::size_t entries() const { return folder_.names().size(); }
  test::TemporaryFolder folder_;
};

std::span<const std::byte> bytesOf(std::string_view text) {
  return std::as_bytes(std::span(text.data(), text.size()));
}
void put(const fs::path& path, std::string_view text) { std::ofstream(path) << text; }

TEST_F(AtomicFileTest, AppearsOnlyOnCommit) {
  AtomicFile file(target(), false);
  file.write(bytesOf("one "));
  file.write(bytesOf("two"));
  EXPECT_FALSE(fs::exists(target()));
  file.commit();
  EXPECT_EQ(test::readText(target()), "one two");
  EXPECT_EQ(entries(), 1u);
}

TEST_F(AtomicFileTest, LeavesNothingWithoutCommit) {
  {
    AtomicFile file(target(), false);
    file.write(bytesOf("half"));
    EXPECT_EQ(entries(), 1u);
  }
  EXPECT_EQ(entries(), 0u);
}

TEST_F(AtomicFileTest, TakesWhatALibraryWritesByName) {
  AtomicFile file(target(), false);
  put(file.path(), "by name");
  file.commit();
  EXPECT_EQ(test::readText(target()), "by name");
}

TEST_F(AtomicFileTest, RefusesAnExistingTargetAndKeepsIt) {
  put(target(), "old");
  EXPECT_THAT([&] { AtomicFile(target(), false); },
              test::ThrowsSaying<RuntimeFailure>("exists already"));
  EXPECT_EQ(test::readText(target()), "old");
  EXPECT_EQ(entries(), 1u);
}

TEST_F(AtomicFileTest, RefusesATargetThatAppearedMeanwhile) {
  AtomicFile file(target(), false);
  file.write(bytesOf("new"));
  put(target(), "somebody else's");
  EXPECT_THROW(file.commit(), RuntimeFailure);
  EXPECT_EQ(test::readText(target()), "somebody else's");
}

TEST_F(AtomicFileTest, ReplacesWhenAskedAndKeepsTheFileUntilThen) {
  put(target(), "old");
  AtomicFile file(target(), true);
  file.write(bytesOf("new"));
  EXPECT_EQ(test::readText(target()), "old");
  file.commit();
  EXPECT_EQ(test::readText(target()), "new");
}

TEST_F(AtomicFileTest, ReplacingDoesNotWidenPermissions) {
  put(target(), "old");
  fs::permissions(target(), fs::perms(0600));
  AtomicFile file(target(), true);
  file.commit();
  EXPECT_EQ(fs::status(target()).permissions(), fs::perms(0600));
}

TEST_F(AtomicFileTest, FollowsASymbolicLink) {
  put(folder_ / "real", "old");
  fs::create_symlink("real", target());
  AtomicFile file(target(), true);
  file.write(bytesOf("new"));
  file.commit();
  EXPECT_TRUE(fs::is_symlink(target()));
  EXPECT_EQ(test::readText(folder_ / "real"), "new");
}

TEST_F(AtomicFileTest, RefusesDevicesAndDirectoriesEvenWhenAskedToReplace) {
  EXPECT_THAT([&] { AtomicFile("/dev/full", true); },
              test::ThrowsSaying<RuntimeFailure>("/dev/full"));
  EXPECT_THAT([&] { AtomicFile(folder_.path(), true); },
              test::ThrowsSaying<RuntimeFailure>("not a regular file"));
}

TEST_F(AtomicFileTest, NamesAMissingDirectory) {
  EXPECT_THAT([&] { AtomicFile(folder_ / "no" / "out.esvr", false); },
              test::ThrowsSaying<RuntimeFailure>("no/out.esvr: No such file"));
}

TEST_F(AtomicFileTest, AFullDiskIsAFailureAndLeavesTheOldFile) {
  put(target(), "old");
  {
    AtomicFile file(target(), true);
    const test::FileSizeLimit limit(1000);
    const std::string big(5000, 'x');
    EXPECT_THAT([&] { file.write(bytesOf(big)); }, test::ThrowsSaying<RuntimeFailure>("out.esvr"));
  }
  EXPECT_EQ(test::readText(target()), "old");
  EXPECT_EQ(entries(), 1u);
}

/// A process that writes a file of one megabyte again and again.
pid_t startWriter(const fs::path& target) {
  const pid_t child = ::fork();
  if (child != 0) return child;
  const std::string content(1 << 20, 'n');
  for (;;) {
    AtomicFile file(target, true);
    for (std::size_t at = 0; at < content.size(); at += 1 << 16)
      file.write(bytesOf(std::string_view(content).substr(at, 1 << 16)));
    file.commit();
  }
}

// If a write is killed at any of a hundred moments, the file is the old one or the complete new
// one, and the next write removes temporary files.
TEST_F(AtomicFileTest, SlowSurvivesBeingKilled) {
  const std::string oldContent(1 << 20, 'o'), newContent(1 << 20, 'n');
  int leftOver = 0;
  for (int round = 0; round < 100; ++round) {
    {
      AtomicFile file(target(), true);
      EXPECT_LE(entries(), 2u);
      file.write(bytesOf(oldContent));
      file.commit();
    }
    const pid_t writer = startWriter(target());
    ::usleep(useconds_t(500 + 97 * round));
    ::kill(writer, SIGKILL);
    ASSERT_EQ(::waitpid(writer, nullptr, 0), writer);
    const std::string content = test::readText(target());
    ASSERT_TRUE(content == oldContent || content == newContent) << content.size();
    leftOver += entries() > 1 ? 1 : 0;
  }
  EXPECT_GT(leftOver, 0) << "no write was interrupted";
  AtomicFile(target(), true).commit();
  EXPECT_EQ(entries(), 1u);
}

TEST_F(AtomicFileTest, LeavesTheTemporaryFilesOfOthersAlone) {
  AtomicFile alive(target(), false);
  put(folder_ / ".esvr-12345678.tmp.keep", "not ours");
  put(folder_ / ".esvr-0badcafe.tmp", "left over");
  AtomicFile other(folder_ / "other.esvr", false);
  EXPECT_TRUE(fs::exists(alive.path()));
  EXPECT_TRUE(fs::exists(folder_ / ".esvr-12345678.tmp.keep"));
  EXPECT_FALSE(fs::exists(folder_ / ".esvr-0badcafe.tmp"));
  alive.commit();
  EXPECT_TRUE(fs::exists(target()));
}

/// Runs in a process without the standard descriptors. \return 0 if a file that is written gets none
/// of their numbers, and if what is printed fails
int writeWithoutStandardDescriptors(const std::filesystem::path& target) {
  for (const int fd : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) ::close(fd);
  AtomicFile file(target, true);
  PartialFile partial(target.string() + "2", true, PartialStart::kRefuse);
  if (::write(STDERR_FILENO, "message", 7) >= 0) return 1;
  if (::write(STDOUT_FILENO, "message", 7) >= 0) return 2;
  partial.append(std::as_bytes(std::span(std::string_view("content"))));
  partial.commit();
  file.commit();
  return 0;
}

TEST(AtomicFileAlone, DoesNotGetTheNumberOfAClosedStandardError) {
  const test::TemporaryFolder folder;
  const pid_t child = ::fork();
  if (child == 0) ::_exit(writeWithoutStandardDescriptors(folder / "out"));
  int status = -1;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 0);
  EXPECT_EQ(std::filesystem::file_size(folder / "out"), 0u);
  EXPECT_EQ(std::filesystem::file_size(folder / "out2"), 7u);
}

// Partial files.

class PartialFileTest : public testing::Test {
 protected:
  [[nodiscard]] fs::path target() const { return folder_ / "out.esvr"; }
  void leave(std::string_view text) const {
    PartialFile file(target(), false, PartialStart::kContinue);
    file.append(std::as_bytes(std::span(text)));
  }
  void expectRefused(bool overwrite, PartialStart start, const char* words) const {
    EXPECT_THAT(std::function<void()>([&] { PartialFile(target(), overwrite, start); }),
                test::ThrowsSaying<RuntimeFailure>(words));
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
  EXPECT_EQ(test::readText(target()), "ONE three");
}

TEST_F(PartialFileTest, LeavesNothingWithoutContent) {
  leave("");
  EXPECT_THAT(folder_.names(), IsEmpty());
}

TEST_F(PartialFileTest, IsRefusedAsWanted) {
  leave("one");
  expectRefused(false, PartialStart::kRefuse, "out.esvr.partial");
  EXPECT_EQ(test::readText(PartialFile::pathFor(target())), "one");
}

TEST_F(PartialFileTest, FollowsNoLinkAndOpensNoPipe) {
  const fs::path partial = PartialFile::pathFor(target());
  std::ofstream(folder_ / "other") << "other";
  fs::create_symlink(folder_ / "other", partial);
  expectRefused(true, PartialStart::kContinue, "cannot write");
  EXPECT_EQ(test::readText(folder_ / "other"), "other");
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
    ASSERT_EQ(test::readText(target()), "first");
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
  EXPECT_EQ(test::readText(target()), "old");
  file.commit();
  EXPECT_EQ(test::readText(target()), "new");
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
  EXPECT_EQ(test::readText(target()), "new");
}

// ---- Input files

class ReadInput : public testing::Test {
 protected:
  [[nodiscard]] fs::path path() const { return folder_ / "input"; }
  void write(const std::string& text) const { std::ofstream(path()) << text; }
  void makePipe() const { ASSERT_EQ(::mkfifo(path().c_str(), 0600), 0); }

  test::TemporaryFolder folder_;
};

TEST_F(ReadInput, GivesTheTextOfAFile) {
  const std::string text(100'000, 'x');
  write(text);
  EXPECT_EQ(readText(path()), text);
}

TEST_F(ReadInput, WaitsForAProgramThatWritesToAPipe) {
  makePipe();
  std::thread writer([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    std::ofstream pipe(path());
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    pipe << "first " << std::flush;
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    pipe << "second";
  });
  EXPECT_EQ(readText(path()), "first second");
  writer.join();
}

TEST_F(ReadInput, GivesUpIfNoProgramWritesToAPipeSlow) {
  makePipe();
  EXPECT_THAT([&] { (void)readText(path()); },
              test::ThrowsSaying<BadInput>("input", "no program writes"));
}

TEST_F(ReadInput, RefusesFoldersDevicesAndMissingFiles) {
  EXPECT_THAT([&] { (void)readText(folder_.path()); }, test::ThrowsSaying<BadInput>("folder"));
  EXPECT_THAT([] { (void)readText("/dev/zero"); },
              test::ThrowsSaying<BadInput>("neither a file nor a pipe"));
  EXPECT_THAT([&] { (void)readText(path()); }, test::ThrowsSaying<BadInput>("No such file"));
}

TEST_F(ReadInput, WatchesForAReplacedAChangedAndARemovedFile) {
  write("old");
  const WatchedInputs watched({path(), folder_ / "never there"});
  EXPECT_NO_THROW(watched.requireUnchanged());
  const auto expectChange = [&](const WatchedInputs& inputs, const char* what) {
    EXPECT_THAT([&] { inputs.requireUnchanged(); },
                test::ThrowsSaying<BadInput>(path().string(), what));
  };
  std::ofstream(folder_ / "other") << "new";
  fs::rename(folder_ / "other", path());
  expectChange(watched, "replaced");
  const WatchedInputs second({path()});
  std::this_thread::sleep_for(std::chrono::milliseconds(20));  // beyond the grain of times
  write("NEW");
  expectChange(second, "changed");
  fs::remove(path());
  expectChange(second, "removed");
}

}  // namespace

}  // namespace esvr
