// Plan: the text of every setting is parsed to the same setting. Other texts are refused with a
// list of the valid ones.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "esvr/baseline.h"
#include "esvr/error.h"

namespace esvr {
namespace {

class SettingText : public testing::TestWithParam<const char*> {};

TEST_P(SettingText, comesBackAsItWas) {
  EXPECT_EQ(toString(parseBaseline(GetParam())), GetParam());
}

INSTANTIATE_TEST_SUITE_P(All, SettingText,
                         testing::Values("vdb-float-blosc", "vdb-half-zip", "vdb-half",
                                         "nvdb-float", "nvdb-fp16-zip", "nvdb-fp8-blosc",
                                         "nvdb-fp4,threshold=0.125",
                                         "nvdb-fpn-zip,tolerance=0.1,threshold=0.3",
                                         "nvdb-fpn,tolerance=1e-30", "zfp,accuracy=0.25",
                                         "zfp-bricks,accuracy=0.25", "zfp,precision=6"));

TEST(Setting, keepsAllDigits) {
  const double third = 1.0 / 3.0;
  const BaselineSetting setting{.how = VoxelPacking{PackedForm::kNanoFpN, PackedCodec::kZip, third},
                                .threshold = third / 7};
  const auto back = parseBaseline(toString(setting));
  EXPECT_EQ(std::get<VoxelPacking>(back.how).tolerance, third);
  EXPECT_EQ(back.threshold, third / 7);
}

class RefusedSetting : public testing::TestWithParam<const char*> {};

TEST_P(RefusedSetting, isNoBaseline) { EXPECT_THROW((void)parseBaseline(GetParam()), UsageError); }

INSTANTIATE_TEST_SUITE_P(All, RefusedSetting,
                         testing::Values("", "gzip", "vdb", "nvdb-fpn-zip",
                                         "nvdb-fpn-zip,tolerance=0", "nvdb-fpn-zip,tolerance=x",
                                         "nvdb-fp8,tolerance=0.1", "vdb-half,threshold",
                                         "vdb-half,threshold=-1", "vdb-half,threshold=inf", "zfp",
                                         "zfp,rate=4", "zfp,accuracy=0.1,threshold=0.1"));

TEST(Setting, listsTheValidSettings) {
  try {
    (void)parseBaseline("gzip");
    FAIL();
  } catch (const UsageError& error) {
    EXPECT_THAT(error.what(),
                testing::AllOf(testing::HasSubstr("gzip"), testing::HasSubstr("nvdb-fpn")));
  }
}

}  // namespace
}  // namespace esvr
