// Plan: each form stores a soft ball and gives back its voxels. Lossless forms give back every
// voxel, half floats are within half a unit in the last place, quantised forms within a step of the
// leaf's range, and FpN and ZFP within their bounds. Forms that do not fit the grid are refused.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "baselines/grids.h"
#include "esvr/baseline.h"
#include "esvr/error.h"
#include "esvr/metrics.h"
#include "support/temporary_folder.h"

namespace esvr {
namespace {

struct Form {
  const char* setting;
  double maxError;  ///< see the derivation at the table
};
std::ostream& operator<<(std::ostream& out, const Form& form) { return out << form.setting; }

class BaselineForm : public testing::TestWithParam<Form> {
 protected:
  VolumeGrid grid_ = test::ballGrid();
  test::TemporaryFolder folder_;
  BaselineEncoder encoder_{
      {.grid = grid_, .box = activeBox(grid_.volume), .folder = folder_.path()}};
};

TEST_P(BaselineForm, givesBackTheVoxelsWithinItsBound) {
  const auto encoded = encoder_.encode(parseBaseline(GetParam().setting));
  EXPECT_GT(encoded.bytes, 0u);
  EXPECT_GT(encoded.seconds, 0.0);
  EXPECT_GT(encoder_.secondsToDecode(), 0.0);
  const auto metrics = compareVolumes(grid_.volume, encoder_.decode());
  EXPECT_LE(metrics.maxError, GetParam().maxError);
  EXPECT_EQ(metrics.iou, 1.0);
}

// Values lie in (0, 1]. A half has a mantissa of 11 bits, so its error is at most 2^-12 near 1. A
// leaf's range is at most 1, and FpB divides it into 2^B - 1 steps; the error is half a step plus
// float rounding.
INSTANTIATE_TEST_SUITE_P(All, BaselineForm,
                         testing::Values(Form{"vdb-float-blosc", 0.0}, Form{"vdb-float-zip", 0.0},
                                         Form{"vdb-float", 0.0}, Form{"vdb-half-blosc", 1.0 / 4096},
                                         Form{"nvdb-float", 0.0}, Form{"nvdb-float-zip", 0.0},
                                         Form{"nvdb-float-blosc", 0.0},
                                         Form{"nvdb-fp16-zip", 0.51 / 65535},
                                         Form{"nvdb-fp8", 0.51 / 255},
                                         Form{"nvdb-fp4-blosc", 0.51 / 15},
                                         Form{"nvdb-fpn-zip,tolerance=0.01", 0.0101}));

TEST_P(BaselineForm, leavesNoFileBehind) {
  {
    BaselineEncoder encoder(
        {.grid = grid_, .box = activeBox(grid_.volume), .folder = folder_.path()});
    encoder.encode(parseBaseline(GetParam().setting));
  }
  EXPECT_EQ(folder_.names().size(), 0u);
}

class Encoder : public BaselineForm {};

TEST_F(Encoder, writesFewerBytesAtAHigherThreshold) {
  const auto all = encoder_.encode(parseBaseline("nvdb-fp8-zip")).bytes;
  const auto some = encoder_.encode(parseBaseline("nvdb-fp8-zip,threshold=0.5")).bytes;
  EXPECT_LT(some, all);
  EXPECT_LT(activeVoxelCount(encoder_.decode()), activeVoxelCount(grid_.volume));
}

TEST_F(Encoder, keepsZfpWithinItsAccuracy) {
  if (zfpVersion().empty()) GTEST_SKIP() << "built without ZFP";
  encoder_.encode(parseBaseline("zfp,accuracy=0.0625"));
  EXPECT_GT(encoder_.secondsToDecode(), 0.0);
  EXPECT_LE(compareVolumes(grid_.volume, encoder_.decode()).maxError, 0.0625);
  encoder_.encode(parseBaseline("zfp-bricks,accuracy=0.0625"));
  EXPECT_GT(encoder_.secondsToDecode(), 0.0);
  EXPECT_LE(compareVolumes(grid_.volume, encoder_.decode()).maxError, 0.0625);
  const auto fine = encoder_.encode(parseBaseline("zfp,precision=30"));
  EXPECT_LT(compareVolumes(grid_.volume, encoder_.decode()).maxError, 1e-6);
  EXPECT_GT(fine.bytes, encoder_.encode(parseBaseline("zfp,precision=4")).bytes);
}

TEST_F(Encoder, saysWhatItCannotDo) {
  if (!zfpVersion().empty()) {
    EXPECT_THROW(encoder_.encode(parseBaseline("zfp,precision=33")), UsageError);
    BaselineEncoder bounded({.grid = grid_,
                             .box = activeBox(grid_.volume),
                             .folder = folder_.path(),
                             .maxDenseBytes = 1000});
    EXPECT_THROW(bounded.encode(parseBaseline("zfp,precision=3")), UsageError);
  } else {
    EXPECT_THROW(encoder_.encode(parseBaseline("zfp,precision=3")), UsageError);
  }
  VolumeGrid large = test::ballGrid();
  for (float& value : large.volume.values) value *= 1e6f;
  BaselineEncoder encoder(
      {.grid = large, .box = activeBox(large.volume), .folder = folder_.path()});
  EXPECT_THROW(encoder.encode(parseBaseline("vdb-half-blosc")), UsageError);
}

}  // namespace
}  // namespace esvr
