#pragma once
/// Runs Blender without a window on files of a test.

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cli/converters.h"
#include "cli/run_program.h"

namespace esvr::test {

/// Skips where Blender is not installed.
class Blender : public FolderTest {
 protected:
  void SetUp() override {
    if (std::string(ESVR_BLENDER).empty()) GTEST_SKIP() << "blender is not installed";
  }
  /// Runs a script of this folder.
  static void runScript(const std::string& name, const std::vector<std::string>& arguments) {
    std::vector<std::string> words{"--background",
                                   "--factory-startup",
                                   "--python-exit-code",
                                   "1",
                                   "--python",
                                   std::string(ESVR_SOURCE_DIR) + "/tests/blender/" + name,
                                   "--"};
    words.insert(words.end(), arguments.begin(), arguments.end());
    const ProgramRun run = runProgram(ESVR_BLENDER, words);
    ASSERT_EQ(run.exitCode, 0) << run.out << run.err;
  }
  /// What Blender knows of volumes (import_facts.py).
  [[nodiscard]] nlohmann::json facts(std::vector<std::string> files) const {
    files.insert(files.begin(), at("facts.json"));
    runScript("import_facts.py", files);
    return nlohmann::json::parse(readText(at("facts.json")));
  }
  void makeSample(const std::string& kind, const std::string& resolution) const {
    const auto run =
        runProgram(ESVR_SAMPLE, {kind, at("in.vdb"), "--resolution", resolution, "--force"});
    ASSERT_EQ(run.exitCode, 0) << run.err;
  }
  /// Converts `source` with options of vdb2esvr, and back to back.vdb.
  void convertThereAndBack(const std::string& source, std::vector<std::string> options) const {
    options.insert(options.begin(), {source, at("in.esvr")});
    const auto there = vdb2esvr(options);
    ASSERT_EQ(there.exitCode, 0) << there.err;
    const auto back = esvr2vdb({at("in.esvr"), at("back.vdb")});
    ASSERT_EQ(back.exitCode, 0) << back.err;
  }
};

}  // namespace esvr::test
