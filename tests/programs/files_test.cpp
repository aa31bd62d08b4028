// Plan: an output path is refused before any work, for each reason, and the check leaves no file.

#include "programs/files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cli/run_program.h"
#include "esvr/error.h"

namespace esvr::cli {
namespace {

using test::TemporaryFolder;
using testing::HasSubstr;
using testing::ThrowsMessage;

TEST(CheckOutput, acceptsANewFileAndLeavesNothing) {
  const TemporaryFolder folder;
  EXPECT_NO_THROW(checkOutput(folder / "new.vdb", {".vdb", ".nvdb"}, false));
  EXPECT_TRUE(folder.names().empty());
}

TEST(CheckOutput, namesTheExtensionsThatAreAllowed) {
  const TemporaryFolder folder;
  EXPECT_THAT(
      [&] {
        checkOutput(folder / "new.txt", {".vdb", ".nvdb"}, false);
      },
      ThrowsMessage<UsageError>(HasSubstr(".vdb or .nvdb")));
}

TEST(CheckOutput, keepsAnExistingFileUnlessForced) {
  const TemporaryFolder folder;
  test::writeText(folder / "old.vdb", "precious");
  EXPECT_THAT([&] { checkOutput(folder / "old.vdb", {".vdb"}, false); },
              ThrowsMessage<RuntimeFailure>(HasSubstr("--force")));
  EXPECT_NO_THROW(checkOutput(folder / "old.vdb", {".vdb"}, true));
  EXPECT_EQ(test::readText(folder / "old.vdb"), "precious");
}

TEST(CheckOutput, refusesAFolderThatIsNotThere) {
  const TemporaryFolder folder;
  EXPECT_THAT([&] { checkOutput(folder / "none/new.vdb", {".vdb"}, false); },
              ThrowsMessage<RuntimeFailure>(HasSubstr("none/new.vdb")));
}

}  // namespace
}  // namespace esvr::cli
