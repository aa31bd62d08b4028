#include "fit/cuda/memory_plan.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <string>

#include "core/cuda/device_buffer.h"
#include "esvr/error.h"
#include "fit/cuda/step.h"

namespace esvr::cuda {
namespace {

constexpr double kSpare = 1.25;         // factor by which a GrowingBuffer grows
constexpr double kReachedShare = 1.0;   // estimate of reached bricks per target brick
constexpr double kReach = 3.2;          // width of a support / distance between ellipsoids
constexpr double kSlotsPerEntry = 4.0;  // largest number of slots of a hash table per entry

constexpr double kBytesOfValues = double(kBrickVoxels * sizeof(float));  // values of a brick
constexpr double kBytesPerBrick = kBytesOfValues + sizeof(Coord) + sizeof(double) * 5 +
                                  sizeof(std::uint64_t) * 2 +
                                  sizeof(std::uint32_t) * (5 + kSlotsPerEntry);
constexpr double kBytesPerTarget = kBytesOfValues + sizeof(BrickMask);
constexpr double kBytesPerReached = kSlotsPerEntry * sizeof(ReachedSlot);
constexpr double kBytesPerPair =
    double(kMoments * sizeof(float)) + 8.0 * sizeof(std::uint32_t);  // lists, also sorted
constexpr double kBytesPerEllipsoid =
    double(sizeof(Ellipsoid) + sizeof(AdamState) + sizeof(PairForm) + sizeof(Usefulness) +
           sizeof(ListedSupport)) +
    double(kMoments * sizeof(double)) + 9.0 * sizeof(std::uint32_t) + sizeof(Coord) * 2;

double pairsOf(const FitSize& size, double ellipsoids) {
  const double distance = std::cbrt(double(size.activeVoxels) / ellipsoids);
  return ellipsoids * std::pow(1.0 + kReach * distance / kBrickSide, 3.0);
}

double bytesOf(const FitSize& size, double ellipsoids) {
  const auto targets = double(size.bricks);
  const double reached = size.narrowBand ? 0.0 : kReachedShare * targets;
  const double arrays = size.constants ? 2.0 : 1.0;  // the values, and the constants like them
  return targets * (kBytesPerTarget + (arrays - 1.0) * kBytesOfValues) +
         kSpare * ((targets + reached) * kBytesPerBrick + reached * kBytesPerReached +
                   ellipsoids * kBytesPerEllipsoid + pairsOf(size, ellipsoids) * kBytesPerPair);
}

double bytesOf(const FitTarget& target, double ellipsoids) {
  return bytesOf(sizeOf(target), ellipsoids);
}

/// The largest number of ellipsoids whose fit takes at most `bound` bytes; 0 if the bricks alone
/// take more.
std::size_t maxEllipsoidsIn(const FitTarget& target, double bound) {
  double low = 0.0, high = double(target.activeVoxels);
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (bytesOf(target, std::max(middle, 1.0)) <= bound ? low : high) = middle;
  }
  return std::size_t(low);
}

std::string megabytes(double bytes) { return std::to_string(std::llround(bytes / 1e6)) + " MB"; }

}  // namespace

std::size_t predictedBytes(const FitTarget& target, std::size_t ellipsoids) {
  return std::size_t(bytesOf(target, std::max(double(ellipsoids), 1.0)));
}

void requireMemory(const FitTarget& target, std::size_t ellipsoids,
                   std::optional<std::size_t> maxBytes, double extra) {
  const double need = double(predictedBytes(target, ellipsoids)) + extra;
  const auto have = double(maxBytes ? *maxBytes : availableMemory());
  if (need <= have) return;
  const std::size_t would = maxEllipsoidsIn(target, have - extra);
  throw DeviceError("fitting " + std::to_string(ellipsoids) + " ellipsoids to " +
                    std::to_string(target.bricks.size()) + " bricks takes about " +
                    megabytes(need) + " on the GPU, and " + megabytes(have) +
                    (maxBytes ? " are allowed" : " are free") +
                    (would > 0 ? "; " + std::to_string(would) + " ellipsoids would fit"
                               : "; the bricks alone do not fit; the CPU can fit them"));
}

std::size_t affordableEllipsoids(const FitTarget& target, std::size_t wanted,
                                 std::optional<std::size_t> maxBytes) {
  const auto have = double(maxBytes ? *maxBytes : availableMemory());
  if (bytesOf(target, std::max(double(wanted), 1.0)) <= have) return wanted;
  return std::min(wanted, maxEllipsoidsIn(target, have));
}

bool fitsInMemory(const FitTarget& target, std::optional<std::size_t> maxBytes) {
  return 2.0 * double(predictedBytes(target, 1)) <=
         double(maxBytes ? *maxBytes : availableMemory());
}

bool fitsInMemory(const FitSize& size, std::size_t ellipsoids,
                  std::optional<std::size_t> maxBytes) {
  return bytesOf(size, double(ellipsoids)) <= double(maxBytes ? *maxBytes : availableMemory());
}

std::vector<std::size_t> allButLowest(std::span<const double> values, std::size_t dropped) {
  std::vector<std::size_t> places(values.size());
  std::iota(places.begin(), places.end(), std::size_t{0});
  std::stable_sort(places.begin(), places.end(),
                   [&](std::size_t a, std::size_t b) { return values[a] < values[b]; });
  places.erase(places.begin(), places.begin() + std::ptrdiff_t(std::min(dropped, places.size())));
  std::sort(places.begin(), places.end());
  return places;
}

}  // namespace esvr::cuda
