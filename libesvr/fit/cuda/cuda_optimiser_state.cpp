#include <span>
#include <vector>

#include "core/cuda/copy.h"
#include "fit/cuda/cuda_optimiser.h"

namespace esvr::cuda {

std::size_t CudaOptimiser::deviceBytes() const { return memory_.peak(); }

std::vector<Ellipsoid> CudaOptimiser::ellipsoids() const {
  std::vector<Ellipsoid> host(count_);
  downloadTo(std::span<Ellipsoid>(host), ellipsoids_.data(), stream_.get());
  return host;
}

void CudaOptimiser::setEllipsoids(std::span<const Ellipsoid> ellipsoids) {
  count_ = stepped_ = 0;
  reserve(ellipsoids.size());
  count_ = ellipsoids.size();
  uploadTo(ellipsoids_.data(), ellipsoids, stream_.get());
  const std::vector<AdamState> fresh(count_);
  uploadTo(adam_.data(), std::span<const AdamState>(fresh), stream_.get());
  writeForms();
  stale_ = true;
}

void CudaOptimiser::setState(const FitState& state) {
  setEllipsoids(state.ellipsoids);
  uploadTo(adam_.data(), std::span<const AdamState>(state.adam), stream_.get());
  std::vector<ListedSupport> listed;
  for (const Ellipsoid& p : state.ellipsoids) listed.push_back(unlisted(p));
  uploadTo(listed_.data(), std::span<const ListedSupport>(listed), stream_.get());
}

FitState CudaOptimiser::state() const {
  FitState state{ellipsoids(), std::vector<AdamState>(count_)};
  downloadTo(std::span(state.adam), adam_.data(), stream_.get());
  return state;
}

std::vector<EllipsoidGradient> CudaOptimiser::gradients(int threads) {
  rebuildLists();
  launchGradients(passArguments(), threads, stream_.get());
  launchMomentSums(momentSums(), stream_.get());
  DeviceBuffer<EllipsoidGradient> out(count_, stream_.get());
  launchReadGradients(stepArguments(0.0, 0), out.data(), stream_.get());
  std::vector<EllipsoidGradient> host(count_);
  out.download(host);
  return host;
}

std::vector<Ellipsoid> CudaOptimiser::seenEllipsoids() {
  const auto all = ellipsoids();
  const auto gradient = gradients();
  std::vector<Ellipsoid> seen;
  for (std::size_t i = 0; i < all.size(); ++i)
    if (gradient[i].phi2 > 0.0 && all[i].intensity != 0.0) seen.push_back(all[i]);
  return seen;
}

void CudaOptimiser::dropUnseen() {
  if (count_ > 0) setEllipsoids(withFewer([&] { return seenEllipsoids(); }));
}

}  // namespace esvr::cuda
