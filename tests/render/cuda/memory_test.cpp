// Plan: a picture for which the device has too little memory ends with an error that says so, and
// the renderer draws again afterwards. Slots that bricks leave are chosen in the order of their
// last reading, and only those that have an owner.
#include <cuda_runtime_api.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "esvr/error.h"
#include "esvr/render.h"
#include "field/random_field.h"
#include "render/cuda/cell_store.h"
#include "render/scenes.h"
#include "support/machine.h"

namespace esvr::test {
namespace {

/// Takes all memory of the device but for some bytes.
class TakenMemory {
 public:
  explicit TakenMemory(std::size_t left) {
    std::size_t free = 0, all = 0;
    EXPECT_EQ(cudaMemGetInfo(&free, &all), cudaSuccess);
    EXPECT_EQ(cudaMalloc(&memory_, free - left), cudaSuccess);
  }
  TakenMemory(const TakenMemory&) = delete;
  TakenMemory& operator=(const TakenMemory&) = delete;
  ~TakenMemory() { cudaFree(memory_); }

 private:
  void* memory_ = nullptr;
};

using MemoryOnGpu = OnGpu;

TEST_F(MemoryOnGpu, IsSaidToBeExhaustedAndIsUsedAgain) {
  const Field field = randomField({.count = 2000, .extent = 200.0});
  const RenderOptions small = pictureOf({{0, 0, 0}, {199, 199, 199}}, {160, 120}, 1.0);
  RenderOptions large = small;
  large.resolution = {4000, 3000};  // 192 MB of pixels
  const auto renderer = makeFieldRenderer(field, device_);
  const Image expected = renderer->draw(small);
  {
    const TakenMemory taken(std::size_t(64) << 20);
    EXPECT_THROW((void)renderer->draw(large), DeviceError);
    EXPECT_EQ(renderer->draw(small).rgba, expected.rgba);
  }
  EXPECT_EQ(renderer->draw(large).width, 4000);
}

using cuda::kNoOwner;
using cuda::oldestSlots;
using testing::IsEmpty;
using testing::UnorderedElementsAre;

const std::vector<std::uint32_t> kOwners{10, 11, kNoOwner, 12}, kStamps{5, 2, 0, 9};

TEST(OldestSlots, AreThoseThatWereNotReadForTheLongestTime) {
  EXPECT_THAT(oldestSlots(1, kOwners, kStamps), UnorderedElementsAre(1u));
  EXPECT_THAT(oldestSlots(2, kOwners, kStamps), UnorderedElementsAre(0u, 1u));
}

TEST(OldestSlots, AreNoMoreThanThereAre) {
  EXPECT_THAT(oldestSlots(9, kOwners, kStamps), UnorderedElementsAre(0u, 1u, 3u));
  EXPECT_THAT(oldestSlots(3, {}, {}), IsEmpty());
}

}  // namespace
}  // namespace esvr::test
