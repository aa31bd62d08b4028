// Plan: texts are read from files and from pipes, with and without a program that writes to them.
// Watched files are replaced, changed and removed.

#include "core/read_input.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <chrono>
#include <fstream>
#include <string>
#include <thread>

#include "esvr/error.h"
#include "support/temporary_folder.h"

namespace esvr {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;
using testing::ThrowsMessage;

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
              ThrowsMessage<BadInput>(AllOf(HasSubstr("input"), HasSubstr("no program writes"))));
}

TEST_F(ReadInput, RefusesFoldersDevicesAndMissingFiles) {
  EXPECT_THAT([&] { (void)readText(folder_.path()); },
              ThrowsMessage<BadInput>(HasSubstr("folder")));
  EXPECT_THAT([] { (void)readText("/dev/zero"); },
              ThrowsMessage<BadInput>(HasSubstr("neither a file nor a pipe")));
  EXPECT_THAT([&] { (void)readText(path()); }, ThrowsMessage<BadInput>(HasSubstr("No such file")));
}

TEST_F(ReadInput, WatchesForAReplacedAChangedAndARemovedFile) {
  write("old");
  const WatchedInputs watched({path(), folder_ / "never there"});
  EXPECT_NO_THROW(watched.requireUnchanged());
  const auto expectChange = [&](const WatchedInputs& inputs, const char* what) {
    EXPECT_THAT([&] { inputs.requireUnchanged(); },
                ThrowsMessage<BadInput>(AllOf(HasSubstr(path().string()), HasSubstr(what))));
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
