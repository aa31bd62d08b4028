#pragma once
/// Files for the tests of this folder: the real volumes and a folder of one's own.

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "support/temporary_folder.h"

namespace esvr::test {

/// The folder of the real volumes; empty if none is configured.
inline std::filesystem::path dataDir() { return ESVR_DATA_DIR; }

}  // namespace esvr::test

#define ESVR_NEEDS_DATA()            \
  if (esvr::test::dataDir().empty()) \
  GTEST_SKIP() << "needs the real volumes: configure with -DESVR_DATA_DIR=<their folder>"
