#include "fit/chunks/whole_progress.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "fit/recorder.h"

namespace esvr {

WholeProgress::WholeProgress(const FitScene& scene, std::function<void(const FitProgress&)> report)
    : report_(std::move(report)), boxVoxels_(scene.box.volume()) {
  for (const BrickChunk& chunk : scene.chunks) activeVoxels_ += chunk.activeVoxels;
  for (const BrickChunk& chunk : scene.chunks)
    chunks_.push_back({.share = double(chunk.activeVoxels) / double(activeVoxels_),
                       .boxVoxels = boxOf(scene, chunk).volume()});
}

double WholeProgress::seconds() const {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
}

std::function<void(const FitProgress&)> WholeProgress::of(std::size_t chunk) {
  if (!report_) return {};
  return [this, chunk](const FitProgress& now) {
    const std::lock_guard lock(mutex_);
    take(chunk, now);
    report_(whole());
  };
}

void WholeProgress::take(std::size_t chunk, const FitProgress& now) {
  Chunk& state = chunks_[chunk];
  state.fraction = std::max(state.fraction, now.fraction);
  state.squares = state.boxVoxels * std::pow(10.0, -0.1 * now.point.psnrBox);
  state.ellipsoids = now.point.ellipsoids;
}

void WholeProgress::end(std::size_t chunk, const PartEnd& part, double fraction) {
  const std::lock_guard lock(mutex_);
  // A part ends at a whole iteration, which may be a little later.
  chunks_[chunk].fraction = std::max(chunks_[chunk].fraction, fraction);
  chunks_[chunk].ellipsoids = part.fit.ellipsoids.size();
  ++partsDone_;
  if (report_) report_(whole());
}

FitProgress WholeProgress::whole() const {
  FitProgress now;
  double squares = 0.0;
  for (const Chunk& chunk : chunks_) {
    now.fraction += chunk.share * chunk.fraction;
    now.point.ellipsoids += chunk.ellipsoids;
    squares += chunk.squares;
  }
  now.fraction = std::min(1.0, now.fraction);  // the shares are rounded
  now.point.seconds = seconds();
  now.point.psnrBox = psnrOf(squares, boxVoxels_, 1.0);
  now.parts = chunks_.size() * kRounds;
  now.partsDone = partsDone_;
  addRates(now, activeVoxels_);
  return now;
}

}  // namespace esvr
