#include "fit/paper/cuda_paper_loss.h"

#include <numeric>
#include <vector>

#include "core/cuda/device_buffer.h"
#include "core/cuda/reduce.cuh"
#include "core/cuda/runtime.h"
#include "fit/paper/ssim_math.h"

namespace esvr::cuda {

/// The two passes of the loss over the bricks. The first evaluates all windows, the second the
/// derivatives by all values. All pointers are to device memory that the caller owns.
struct SsimPassArguments {
  BrickTableView values;  ///< the bricks of prediction and target
  std::uint32_t valueCount, targetCount;
  const float* residual;   ///< prediction - target, kBrickVoxels values for each brick
  const float* target;     ///< target in the first targetCount bricks; it is zero in others
  BrickTableView windows;  ///< the bricks whose voxels have windows around them
  std::uint32_t windowCount;
  std::array<double, kSsimTaps> weights;
  SsimConstants constants;
  double absoluteScale, ssimScale;  ///< factors of sum |r| and sum (1 - SSIM) in the loss
  double* byR;         ///< kBrickVoxels values for each brick of windows: WindowGradients::byR
  float *byRr, *byTr;  ///< WindowGradients::byRr and byTr, in the same layout
  double* windowLoss;  ///< output: share of each brick of windows in the loss
  double* valueLoss;   ///< output: share of each brick of values in the loss
  float* lossByValue;  ///< output, in the layout of the residual
};

namespace {

constexpr int kThreads = 256;
constexpr int kOwnVoxels = kBrickVoxels / kThreads;  // voxels of a brick for each thread
constexpr int kNeighbours = 27;
constexpr int kSlice = kHaloSide * kHaloSide;
/// Numbers of partial sums of a brick's windows: first along x, then along x and y.
constexpr int kSumsX = kBrickSide * kSlice, kSumsXy = kBrickSide * kBrickSide * kHaloSide;
constexpr std::size_t kSumBytes = (kSumsX + kSumsXy) * sizeof(double);
constexpr std::size_t kWindowSideBytes = kSumBytes + 2 * kHaloVoxels * sizeof(float);
constexpr std::size_t kValueSideBytes = kSumBytes + kHaloVoxels * sizeof(double);

using Weights = std::array<double, kSsimTaps>;
using OwnSums = double[kOwnVoxels];

/// Finds the numbers of a brick and its 26 neighbours. Ends with a barrier.
__device__ void findAround(const BrickTableView& table, Coord brick, std::uint32_t* around) {
  const int n = int(threadIdx.x);
  if (n < kNeighbours) around[n] = table.find(brick + Coord{n / 9 - 1, n / 3 % 3 - 1, n % 3 - 1});
  __syncthreads();
}

/// The position of a voxel of the halo: which of the 27 bricks it is in, and its offset there.
struct HaloPlace {
  int brick, voxel;
};
__device__ HaloPlace placeOf(int halo) {
  const Coord at{halo / kSlice - kSsimRadius, halo / kHaloSide % kHaloSide - kSsimRadius,
                 halo % kHaloSide - kSsimRadius};
  const Coord step = brickOf(at);
  return {(step.x + 1) * 9 + (step.y + 1) * 3 + step.z + 1, voxelOffset(localOf(at))};
}

/// Sums a window along one axis. The window is symmetric, so two values share a multiplication.
/// \param at  at(tap) returns the value for a weight of the window
template <class At>
__device__ double sumTaps(const Weights& weights, At&& at) {
  double sum = weights[kSsimRadius] * at(kSsimRadius);
#pragma unroll
  for (int tap = 0; tap < kSsimRadius; ++tap)
    sum += weights[tap] * (at(tap) + at(kSsimTaps - 1 - tap));
  return sum;
}

/// Shared memory of one block.
struct Scratch {
  double *sumsX, *sumsXy;
  void* halo;
};
__device__ Scratch scratch() {
  extern __shared__ double memory[];
  return {memory, memory + kSumsX, memory + kSumsX + kSumsXy};
}

/// The voxel of a thread's sum number n.
__device__ int ownVoxel(int n) { return int(threadIdx.x) + n * kThreads; }

/// Sums the windows around the brick's voxels axis by axis.
/// \param value  value(offset) returns the value at an offset of the halo
template <class Value>
__device__ void sumWindows(const Weights& weights, const Scratch& s, Value&& value, OwnSums& out) {
  for (int i = int(threadIdx.x); i < kSumsX; i += kThreads)
    s.sumsX[i] = sumTaps(weights, [&](int tap) { return value(i + tap * kSlice); });
  __syncthreads();
  for (int i = int(threadIdx.x); i < kSumsXy; i += kThreads) {
    constexpr int kRows = kBrickSide * kHaloSide;  // results in a slice
    const double* const from = s.sumsX + i / kRows * kSlice + i % kRows;
    s.sumsXy[i] = sumTaps(weights, [&](int tap) { return from[tap * kHaloSide]; });
  }
  __syncthreads();
  for (int n = 0; n < kOwnVoxels; ++n) {
    const int v = ownVoxel(n);
    const double* const from = s.sumsXy + v / kBrickSide * kHaloSide + v % kBrickSide;
    out[n] = sumTaps(weights, [&](int tap) { return from[tap]; });
  }
}

/// Loads residual and target of a brick and its surroundings. Ends with a barrier.
/// \return true if any value is not zero
__device__ bool fillHalo(const SsimPassArguments& a, const std::uint32_t* around, float* r,
                         float* t) {
  bool any = false;
  for (int i = int(threadIdx.x); i < kHaloVoxels; i += kThreads) {
    const HaloPlace place = placeOf(i);
    const std::uint32_t brick = around[place.brick];
    const std::size_t at = std::size_t(brick) * kBrickVoxels + std::size_t(place.voxel);
    r[i] = brick != kNoBrick ? a.residual[at] : 0.0f;
    t[i] = brick != kNoBrick && brick < a.targetCount ? a.target[at] : 0.0f;
    any = any || r[i] != 0.0f || t[i] != 0.0f;
  }
  return __syncthreads_or(any) != 0;
}

/// Each block evaluates the windows around the voxels of one brick.
__global__ void __launch_bounds__(kThreads) windowSide(const SsimPassArguments a) {
  __shared__ std::uint32_t around[kNeighbours];
  const Scratch s = scratch();
  float* const r = static_cast<float*>(s.halo);
  float* const t = r + kHaloVoxels;
  findAround(a.values, a.windows.bricks[blockIdx.x], around);

  OwnSums sumT{}, sumTt{}, sumR{}, sumRr{}, sumTr{};
  if (fillHalo(a, around, r, t)) {
    sumWindows(
        a.weights, s, [&](int i) { return double(t[i]); }, sumT);
    sumWindows(
        a.weights, s, [&](int i) { return double(r[i]); }, sumR);
    sumWindows(
        a.weights, s, [&](int i) { return double(t[i]) * double(t[i]); }, sumTt);
    sumWindows(
        a.weights, s, [&](int i) { return double(r[i]) * double(r[i]); }, sumRr);
    sumWindows(
        a.weights, s, [&](int i) { return double(t[i]) * double(r[i]); }, sumTr);
  }
  double loss = 0.0;
  for (int n = 0; n < kOwnVoxels; ++n) {
    const Dissimilarity d =
        dissimilarity({sumT[n], sumTt[n], sumR[n], sumRr[n], sumTr[n]}, a.constants);
    const std::size_t at = std::size_t(blockIdx.x) * kBrickVoxels + std::size_t(ownVoxel(n));
    a.byR[at] = d.byR;
    a.byRr[at] = d.byRr;
    a.byTr[at] = d.byTr;
    loss += d.value;
  }
  loss = blockSum<kThreads>(loss);
  if (threadIdx.x == 0) a.windowLoss[blockIdx.x] = a.ssimScale * loss;
}

/// Sums `values` of the windows that cover each voxel of a brick, with the window's weights.
template <class T>
__device__ void sumGradients(const SsimPassArguments& a, const std::uint32_t* around,
                             const T* values, OwnSums& out) {
  const Scratch s = scratch();
  double* const halo = static_cast<double*>(s.halo);
  for (int i = int(threadIdx.x); i < kHaloVoxels; i += kThreads) {
    const HaloPlace place = placeOf(i);
    const std::uint32_t brick = around[place.brick];
    const std::size_t at = std::size_t(brick) * kBrickVoxels + std::size_t(place.voxel);
    halo[i] = brick != kNoBrick ? double(values[at]) : 0.0;
  }
  __syncthreads();
  sumWindows(
      a.weights, s, [&](int i) { return halo[i]; }, out);
}

/// Each block computes the derivatives by the values of one brick.
__global__ void __launch_bounds__(kThreads) valueSide(const SsimPassArguments a) {
  __shared__ std::uint32_t around[kNeighbours];
  OwnSums byR{}, byRr{}, byTr{};
  if (a.ssimScale != 0.0) {
    findAround(a.windows, a.values.bricks[blockIdx.x], around);
    sumGradients(a, around, a.byR, byR);
    sumGradients(a, around, a.byRr, byRr);
    sumGradients(a, around, a.byTr, byTr);
  }
  double absolute = 0.0;
  for (int n = 0; n < kOwnVoxels; ++n) {
    const std::size_t at = std::size_t(blockIdx.x) * kBrickVoxels + std::size_t(ownVoxel(n));
    const double r = double(a.residual[at]);
    const double t = blockIdx.x < a.targetCount ? double(a.target[at]) : 0.0;
    const double bySsim = byR[n] + (2.0 * r * byRr[n] + t * byTr[n]) / a.constants.c2;
    const double bySign = double((r > 0.0) - (r < 0.0));
    a.lossByValue[at] = float(a.absoluteScale * bySign + a.ssimScale * bySsim);
    absolute += fabs(r);
  }
  absolute = blockSum<kThreads>(absolute);
  if (threadIdx.x == 0) a.valueLoss[blockIdx.x] = a.absoluteScale * absolute;
}

template <class Kernel>
void allowShared(Kernel* kernel, std::size_t bytes) {
  check(cudaFuncSetAttribute(kernel, cudaFuncAttributeMaxDynamicSharedMemorySize, int(bytes)),
        "asking for shared memory");
}

/// Fills byR, byRr, byTr and windowLoss.
/// \throws DeviceError  the device has too little shared memory
void launchWindowSide(const SsimPassArguments& a, cudaStream_t stream) {
  if (a.windowCount == 0) return;
  allowShared(windowSide, kWindowSideBytes);
  windowSide<<<a.windowCount, kThreads, kWindowSideBytes, stream>>>(a);
  check(cudaGetLastError(), "starting the windows of SSIM");
}

/// Fills lossByValue and valueLoss. launchWindowSide must have been called before, unless ssimScale
/// is 0.
void launchValueSide(const SsimPassArguments& a, cudaStream_t stream) {
  if (a.valueCount == 0) return;
  allowShared(valueSide, kValueSideBytes);
  valueSide<<<a.valueCount, kThreads, kValueSideBytes, stream>>>(a);
  check(cudaGetLastError(), "starting the derivatives of SSIM");
}

double sumOf(const double* device, std::size_t count, cudaStream_t stream) {
  std::vector<double> values(count);
  downloadTo(std::span<double>(values), device, stream);
  return std::accumulate(values.begin(), values.end(), 0.0);
}

}  // namespace

PaperLoss::PaperLoss(cudaStream_t stream)
    : stream_(stream),
      byR_(stream),
      windowLoss_(stream),
      valueLoss_(stream),
      byRr_(stream),
      byTr_(stream),
      lossByValue_(stream) {}

SsimPassArguments PaperLoss::passArguments(const PaperLossArguments& a) {
  const std::size_t windowVoxels = a.windows.size() * kBrickVoxels;
  return {.values = a.bricks.view(),
          .valueCount = std::uint32_t(a.bricks.size()),
          .targetCount = std::uint32_t(a.targetBricks),
          .residual = a.residual,
          .target = a.target,
          .windows = a.windows.view(),
          .windowCount = std::uint32_t(a.windows.size()),
          .weights = weights_,
          .constants = ssimConstants(a.peak),
          .absoluteScale = a.beta / (a.voxels * a.peak),
          .ssimScale = (1.0 - a.beta) / a.voxels,
          .byR = byR_.reserve(windowVoxels),
          .byRr = byRr_.reserve(windowVoxels),
          .byTr = byTr_.reserve(windowVoxels),
          .windowLoss = windowLoss_.reserve(a.windows.size()),
          .valueLoss = valueLoss_.reserve(a.bricks.size()),
          .lossByValue = lossByValue_.reserve(a.bricks.size() * kBrickVoxels)};
}

const float* PaperLoss::derivative(const PaperLossArguments& a) {
  const SsimPassArguments pass = passArguments(a);
  const bool dissimilar = pass.ssimScale != 0.0;
  windowShares_ = dissimilar ? pass.windowCount : 0;
  valueShares_ = pass.valueCount;
  if (dissimilar) launchWindowSide(pass, stream_);
  launchValueSide(pass, stream_);
  return pass.lossByValue;
}

double PaperLoss::loss() const {
  return sumOf(valueLoss_.data(), valueShares_, stream_) +
         sumOf(windowLoss_.data(), windowShares_, stream_);
}

double PaperLoss::bytesFor(double bricks) {
  // Bricks with windows for each brick of values: 27 for a single brick, close to 1 in dense
  // volumes, about 4 for surfaces and tubes.
  constexpr double kWindowBricks = 6.0;
  return bricks * kBrickVoxels *
         (sizeof(float) + kWindowBricks * (sizeof(double) + 2 * sizeof(float)));
}

}  // namespace esvr::cuda
