#include "core/cuda/device_buffer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <limits>
#include <numeric>
#include <optional>
#include <stdexcept>
#include <type_traits>
#include <vector>

#include "core/cuda/stream.h"
#include "support/on_device.h"

namespace esvr::cuda {
namespace {

using testing::AllOf;
using testing::Each;
using testing::HasSubstr;
using testing::ThrowsMessage;

static_assert(!std::is_copy_constructible_v<DeviceBuffer<float>>);
static_assert(!std::is_copy_assignable_v<DeviceBuffer<float>>);
static_assert(std::is_nothrow_move_constructible_v<DeviceBuffer<float>>);

TEST(Check, PassesSuccessAndThrowsCudasOwnTextWithThePlace) {
  EXPECT_NO_THROW(check(cudaSuccess, "adding"));
  EXPECT_THAT([] { check(cudaErrorInvalidValue, "adding"); },
              ThrowsMessage<DeviceError>(AllOf(HasSubstr("adding"), HasSubstr("invalid argument"),
                                               HasSubstr("cudaErrorInvalidValue"),
                                               HasSubstr("device_buffer_test.cpp:"))));
}

TEST(DeviceBuffer, OfNoElementsNeedsNoDevice) {
  DeviceBuffer<float> buffer(0, nullptr);
  EXPECT_EQ(buffer.data(), nullptr);
  EXPECT_EQ(buffer.size(), 0u);
}

class DeviceBufferOnGpu : public test::OnGpu {
 protected:
  void SetUp() override {
    OnGpu::SetUp();
    if (!IsSkipped()) stream.emplace();
  }
  std::optional<Stream> stream;
};

TEST_F(DeviceBufferOnGpu, ReturnsWhatWasPutIn) {
  std::vector<std::int32_t> in(1000);
  std::iota(in.begin(), in.end(), -500);
  const DeviceBuffer<std::int32_t> buffer(in, stream->get());
  std::vector<std::int32_t> out(in.size());
  buffer.download(out);
  EXPECT_EQ(out, in);
}

TEST_F(DeviceBufferOnGpu, IsZeroAfterSetZero) {
  DeviceBuffer<float> buffer(std::vector<float>(100, 3.0f), stream->get());
  buffer.setZero();
  std::vector<float> out(100, 1.0f);
  buffer.download(out);
  EXPECT_THAT(out, Each(0.0f));
}

TEST_F(DeviceBufferOnGpu, MovesItsMemory) {
  DeviceBuffer<float> a(std::array{1.0f, 2.0f}, stream->get());
  const float* memory = a.data();
  DeviceBuffer<float> b(std::move(a));
  EXPECT_EQ(b.data(), memory);
  EXPECT_EQ(b.size(), 2u);
}

TEST_F(DeviceBufferOnGpu, RefusesCopiesOfAnotherSize) {
  DeviceBuffer<float> buffer(3, stream->get());
  std::vector<float> two(2);
  EXPECT_THROW(buffer.upload(two), std::logic_error);
  EXPECT_THROW(buffer.download(two), std::logic_error);
}

TEST_F(DeviceBufferOnGpu, SaysHowMuchWasAskedForWhenMemoryIsOut) {
  // No device has 2^50 bytes, and 2^63 elements of 8 bytes exceed size_t.
  for (const std::size_t n : {std::size_t{1} << 47, std::size_t{1} << 63})
    EXPECT_THAT([&] { DeviceBuffer<double>(n, stream->get()); },
                ThrowsMessage<DeviceError>(HasSubstr(std::to_string(n) + " times 8 bytes")));
  // Later calls must not report this failure again.
  EXPECT_NO_THROW(check(cudaGetLastError(), "nothing"));
}

}  // namespace
}  // namespace esvr::cuda
