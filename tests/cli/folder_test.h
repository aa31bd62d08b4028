#pragma once
/// A test that has a folder.

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "cli/run_program.h"

namespace esvr::test {

class FolderTest : public testing::Test {
 protected:
  [[nodiscard]] std::string at(const std::string& name) const { return folder_ / name; }
  [[nodiscard]] std::uintmax_t sizeOf(const std::string& name) const {
    return std::filesystem::file_size(at(name));
  }
  TemporaryFolder folder_;
};

}  // namespace esvr::test
