// Plan: the commands of a document run in their order and in one folder, so that later ones find the
// files of earlier ones, with small volumes, small pictures and few iterations. Commands of other
// programs (./setup, cmake) are not run, and those on smoke1.vdb only if ESVR_DATA_DIR has it.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <sstream>

#include "cli/run_program.h"

namespace esvr {
namespace {

namespace fs = std::filesystem;
using Words = std::vector<std::string>;

const std::map<std::string, std::string>& programs() {
  static const std::map<std::string, std::string> kPrograms{{"vdb2esvr", VDB2ESVR},
                                                            {"esvr2vdb", ESVR2VDB},
                                                            {"esvr-render", ESVR_RENDER},
                                                            {"esvr-compare", ESVR_COMPARE},
                                                            {"esvr-sample", ESVR_SAMPLE}};
  return kPrograms;
}

/// The words of a line up to a comment.
Words wordsOf(const std::string& line) {
  Words words;
  std::istringstream stream(line);
  for (std::string word; stream >> word && !word.starts_with("#");) words.push_back(word);
  return words;
}

/// The commands in the indented blocks of a document that begin with one of the project's programs.
/// As in a shell, "$ " may stand before a command, and a backslash continues a line.
std::vector<Words> commandsOf(const std::string& document) {
  std::vector<Words> commands;
  std::istringstream lines(document);
  bool goesOn = false;
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with("    ")) continue;
    Words words = wordsOf(line);
    if (!words.empty() && words[0] == "$") words.erase(words.begin());
    if (words.empty() || (!goesOn && !programs().contains(words[0]))) continue;
    if (!goesOn) commands.emplace_back();
    goesOn = words.back() == "\\";
    if (goesOn) words.pop_back();
    commands.back().insert(commands.back().end(), words.begin(), words.end());
  }
  return commands;
}

bool has(const Words& words, const std::string& word) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

/// Sets the value of an option, which is added if it is missing.
void set(Words& words, const std::string& option, const std::string& value) {
  const auto it = std::find(words.begin(), words.end(), option);
  if (it != words.end())
    *std::next(it) = value;
  else
    words.insert(words.end(), {option, value});
}

/// Changes a command so that it takes little time.
Words quickened(Words words) {
  if (words[0] == "esvr-sample") set(words, "--resolution", "40");
  if (words[0] == "vdb2esvr" && !has(words, "--lossless")) set(words, "--iterations", "60");
  if (has(words, "--ratio")) set(words, "--ratio", "500");
  if (words[0] == "esvr-render" && !has(words, "--orthographic"))
    set(words, "--resolution", "48x48");
  if (words[0] == "esvr-compare" && words[1] == "table") {
    set(words, "--runs", "1");
    set(words, "--image-size", "32");
  }
  if (words[0] != "esvr2vdb" || !has(words, "--list"))
    if (words[0] != "esvr-compare" || words[1] != "check") words.emplace_back("--force");
  return words;
}

bool isInput(const std::string& word) {
  return word.ends_with(".vdb") || word.ends_with(".nvdb") || word.ends_with(".esvr");
}

/// A test whose current folder is a temporary one.
class InAFolder : public testing::Test {
 protected:
  void SetUp() override {
    before_ = fs::current_path();
    fs::current_path(folder_ / "");
  }
  void TearDown() override { fs::current_path(before_); }

  test::TemporaryFolder folder_;

 private:
  fs::path before_;
};

class DocumentedCommands : public InAFolder, public testing::WithParamInterface<const char*> {
 protected:
  void SetUp() override {
    InAFolder::SetUp();
    const fs::path data = ESVR_DATA_DIR;
    if (fs::exists(data / "smoke1.vdb")) fs::create_symlink(data / "smoke1.vdb", "smoke1.vdb");
  }

  /// True if the command makes its first file, or if that file exists.
  [[nodiscard]] static bool canRun(const Words& words) {
    if (words[0] == "esvr-sample") return true;
    const auto input = std::find_if(words.begin(), words.end(), isInput);
    return input == words.end() || fs::exists(*input);
  }
  static void run(const Words& words) {
    const Words quick = quickened(words);
    const auto result =
        test::runProgram(programs().at(quick[0]), Words(quick.begin() + 1, quick.end()));
    EXPECT_EQ(result.exitCode, 0) << testing::PrintToString(quick) << "\n" << result.err;
  }
};

TEST_P(DocumentedCommands, run) {
  const auto commands = commandsOf(test::readText(std::string(ESVR_SOURCE_DIR "/") + GetParam()));
  std::size_t ran = 0;
  for (const Words& words : commands)
    if (canRun(words)) {
      run(words);
      ++ran;
    } else {
      EXPECT_TRUE(has(words, "smoke1.vdb") || has(words, "smoke1.esvr"))
          << "no command makes the input of " << testing::PrintToString(words);
    }
  EXPECT_GE(ran, 3u);
}

INSTANTIATE_TEST_SUITE_P(Documents, DocumentedCommands,
                         testing::Values("README.md", "docs/convert.md", "docs/pictures.md"),
                         [](const auto& name) { return fs::path(name.param).stem().string(); });

using DocumentedProgram = InAFolder;

TEST_F(DocumentedProgram, SlowWritesAFileOfItsSize) {
  ASSERT_EQ(test::runProgram(ESVR_SAMPLE, "plume smoke.vdb --resolution 64").exitCode, 0);
  const auto run = test::runProgram(DOCUMENTED_PROGRAM, {});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  EXPECT_LE(fs::file_size("smoke.esvr"), 20'000u + 500u);  // the size is that of the grid
  EXPECT_EQ(test::runProgram(ESVR2VDB, "smoke.esvr back.vdb").exitCode, 0);
}

}  // namespace
}  // namespace esvr
