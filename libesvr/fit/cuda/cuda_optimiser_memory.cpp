#include <algorithm>
#include <numeric>
#include <span>
#include <vector>

#include "core/add_seconds.h"
#include "core/cuda/copy.h"
#include "core/cuda/count32.h"
#include "fit/cuda/cuda_optimiser.h"
#include "fit/cuda/least_useful.h"
#include "fit/cuda/memory_plan.h"

namespace esvr::cuda {

void CudaOptimiser::reserve(std::size_t ellipsoids) {
  (void)count32(ellipsoids, "ellipsoids");
  ellipsoids_.extend(ellipsoids, count_);
  adam_.extend(ellipsoids, count_);
  forms_.extend(ellipsoids, count_);
  usefulness_.extend(ellipsoids, count_);
  listed_.extend(ellipsoids, count_);
}

/// Frees all memory whose contents can be computed again.
void CudaOptimiser::releaseScratch() {
  full_ = stale_ = true;
  lists_ = PairLists(stream_.get());
  sampling_ = VoxelSampling(stream_.get());
  ranking_ = EllipsoidRanking(stream_.get());
  errorSums_ = ErrorSums(stream_.get());
  for (auto* buffer : {&moments_, &residual_}) buffer->release();
  for (auto* buffer : {&brickLoss_, &chunkSums_}) buffer->release();
  trimMemoryPool();
}

/// Keeps the ellipsoids at these places, which must increase, together with their states, and frees
/// the memory of the others.
void CudaOptimiser::keep(std::span<const std::size_t> places) {
  const auto gather = [&]<class T>(GrowingBuffer<T>& buffer) {
    std::vector<T> all(count_), kept;
    downloadTo(std::span<T>(all), buffer.data(), stream_.get());
    for (const std::size_t i : places) kept.push_back(all[i]);
    buffer.release();
    uploadTo(buffer.reserve(kept.size()), std::span<const T>(kept), stream_.get());
  };
  gather(ellipsoids_);
  gather(adam_);
  gather(usefulness_);
  gather(listed_);
  forms_.release();
  forms_.reserve(places.size());
  stepped_ = std::size_t(std::lower_bound(places.begin(), places.end(), stepped_) - places.begin());
  count_ = places.size();
  writeForms();
  stale_ = true;
}

/// Drops the tenth of the ellipsoids whose removal adds the smallest error. New ellipsoids, which
/// have not taken a step yet, are dropped first.
void CudaOptimiser::dropLeastUseful() {
  constexpr std::size_t kShare = 10;
  const auto all = ellipsoids();
  std::vector<Usefulness> usefulness(stepped_);
  downloadTo(std::span(usefulness), usefulness_.data(), stream_.get());
  std::vector<double> worth(count_, 0.0);
  for (std::size_t i = 0; i < stepped_; ++i)
    worth[i] =
        removalError(all[i].intensity, double(usefulness[i].phi2), double(usefulness[i].rPhi));
  keep(allButLowest(worth, count_ / kShare + 1));
}

void CudaOptimiser::grow(std::size_t count) {
  reserve(count);
  count_ += placeSeeds(count - count_, std::max(count - count_, count_), nullptr);
  writeForms();
}

void CudaOptimiser::growTo(std::size_t count) {
  if (count <= count_ || full_) return;
  const AddSeconds timer(secondsSeeding_);
  if (count_ == 0) requireMemory(target_, count, options_.maxDeviceBytes);
  const std::size_t affordable = affordableEllipsoids(target_, count, options_.maxDeviceBytes);
  full_ = affordable < count;
  if (affordable <= count_) return;
  try {
    withRoom([&] { grow(affordable); });
  } catch (const DeviceMemoryError&) {
    if (count_ == 0) throw;
    releaseScratch();
    std::vector<std::size_t> all(count_);
    std::iota(all.begin(), all.end(), std::size_t{0});
    keep(all);  // frees the memory that was reserved for the growth
  }
}

}  // namespace esvr::cuda
