// Plan: bounds on memory that make one, several and as many batches as there are bricks must give
// the same bits.

#include <gtest/gtest.h>

#include "core/cuda/stream.h"
#include "core/cuda/use_device.h"
#include "field/cube.h"
#include "field/cuda/evaluate.h"
#include "field/random_field.h"

namespace esvr::cuda {
namespace {

std::vector<float> evaluate(std::size_t batchBytes) {
  const Field field = test::randomField({.count = 100, .extent = 40});
  const auto corners = test::cube({}, 5);
  std::vector<float> values(corners.size() * kBrickVoxels);
  const Stream stream;
  evaluateBricks(field, corners, values, stream.get(), batchBytes);
  return values;
}

TEST(EvaluateInBatches, GivesTheSameBits) {
  try {
    useDevice(selectDevice("cuda"));
  } catch (const DeviceError& error) {
    GTEST_SKIP() << error.what();
  }
  const auto atOnce = evaluate(std::size_t{1} << 30);
  EXPECT_EQ(evaluate(20'000), atOnce);
  EXPECT_EQ(evaluate(0), atOnce);
}

}  // namespace
}  // namespace esvr::cuda
