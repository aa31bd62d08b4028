#include "cli/number_list.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "esvr/error.h"

namespace esvr::test {
namespace {

using testing::ElementsAre;

TEST(NumberList, ReadsAsManyNumbersAsAskedFor) {
  EXPECT_THAT(cli::parseNumbers("eye", "1,-2.5,3e2", 3), ElementsAre(1.0, -2.5, 300.0));
  EXPECT_THAT(cli::parseNumbers("range", "0,1", 2), ElementsAre(0.0, 1.0));
}

TEST(NumberList, RefusesAnythingElseAndNamesTheOption) {
  for (const char* text : {"", "1", "1,2", "1,2,3,4", "1,2,x", "1 2 3", "1,,3", "1,2,nan",
                           "1,2,inf", "1,2,1e999", "1,2,3 "})
    EXPECT_THROW((void)cli::parseNumbers("eye", text, 3), UsageError) << text;
  try {
    (void)cli::parseNumbers("eye", "1", 3);
  } catch (const UsageError& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("--eye must be 3 numbers"));
  }
}

}  // namespace
}  // namespace esvr::test
