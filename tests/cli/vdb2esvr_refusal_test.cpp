// Plan: vdb2esvr is run with options that are wrong or exclude each other. The tests check the exit
// code, that the message names the option, and that no file is written.

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "cli/refusal.h"
#include "cli/vdb2esvr_fixture.h"

namespace esvr {
namespace {

using test::Refusal;
using test::Vdb2Esvr;
using test::vdb2esvr;

class RefusedOptions : public Vdb2Esvr, public testing::WithParamInterface<Refusal> {};

TEST_P(RefusedOptions, areNamedAndLeaveNoFile) {
  std::vector<std::string> arguments{in(), out()};
  arguments.insert(arguments.end(), GetParam().arguments.begin(), GetParam().arguments.end());
  GetParam().expectOf(vdb2esvr(arguments));
  EXPECT_FALSE(outIsThere());
}

INSTANTIATE_TEST_SUITE_P(
    All, RefusedOptions,
    testing::Values(
        Refusal{{"--size", "5XB"}, 2, "--size"},
        Refusal{{"--size", "9KB", "--psnr", "40"}, 2, "--psnr"},
        Refusal{{"--size", "9KB", "--ratio", "9"}, 2, "--ratio"},
        Refusal{{"--ratio", "0.5"}, 2, "--ratio"}, Refusal{{"--max-error", "0"}, 2, "--max-error"},
        Refusal{{"--max-error", "1x"}, 2, "--max-error"},
        Refusal{{"--representation", "voxels", "--count", "9"}, 2, "--count"},
        Refusal{{"--representation", "cubes"}, 2, "cubes"},
        Refusal{{"--representation", "ellipsoids", "--lossless"}, 2, "--lossless"},
        Refusal{
            {"--representation", "voxels", "--psnr", "40", "--storage", "float32"}, 2, "float32"},
        Refusal{{"--lossless", "--psnr", "40"}, 2, "--psnr"}, Refusal{{"--size", "99"}, 2, "bytes"},
        Refusal{{"--count", "0"}, 2, "--count"}, Refusal{{"--count", "x"}, 2, "x"},
        Refusal{{"--psnr", "-1"}, 2, "--psnr"}, Refusal{{"--psnr", "nan"}, 2, "psnr"},
        Refusal{{"--seconds", "0"}, 2, "--seconds"},
        Refusal{{"--iterations", "0"}, 2, "--iterations"}, Refusal{{"--preset", "best"}, 2, "best"},
        Refusal{{"--box", "1,2,3"}, 2, "--box"}, Refusal{{"--box", "5,5,5,1,1,1"}, 2, "no voxel"},
        Refusal{{"--max-error", "1%", "--paper", "epochs=9"}, 2, "--paper"},
        Refusal{{"--max-error", "1%", "--preset", "paper", "--iterations", "9"}, 2, "paper"},
        Refusal{{"--lossless", "--max-error", "1%"}, 2, "--max-error"},
        Refusal{{"--share", "density"}, 2, "--share"},
        Refusal{{"--paper", "default", "--iterations", "9"}, 2, "--iterations"},
        Refusal{{"--paper", "default", "--preset", "high"}, 2, "--preset"},
        Refusal{{"--paper", "default", "--size", "9KB"}, 2, "--paper"},
        Refusal{{"--paper", "sharpness=3"}, 2, "no key 'sharpness'"},
        Refusal{{"--paper", "k"}, 2, "KEY=VALUE"}, Refusal{{"--paper", "k=soft"}, 2, "soft"},
        Refusal{{"--paper", "k=3,k=4"}, 2, "twice"}, Refusal{{"--paper", "beta=2"}, 2, "beta"},
        Refusal{{"--paper", "epochs=0"}, 2, "epochs"},
        Refusal{{"--paper", "rates=1:2:3"}, 2, "four rates"},
        Refusal{{"--paper", "k=learned", "--storage", "compact"}, 2, "edge"},
        Refusal{{"--paper", "kernel=gaussian,k=3"}, 2, "Gaussians"},
        Refusal{{"--paper", "prunes=2"}, 2, "prunes"},
        Refusal{{"--paper", "prune-score=best"}, 2, "best"}, Refusal{{"--device", "tpu"}, 2, "tpu"},
        Refusal{{"--device", "cuda:4096"}, 5, "cuda:4096"},
        Refusal{{"--report", "report.txt"}, 2, ".json"},
        Refusal{{"more"}, 2, "unexpected argument"}));

}  // namespace
}  // namespace esvr
