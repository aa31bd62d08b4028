#include "fit/chunks/round.h"

#include <cmath>

#include "esvr/error.h"
#include "fit/ellipsoid_math.h"
#include "fit/fit_plan.h"

namespace esvr {
namespace {

int bricksIn(double voxels) { return int(std::ceil(voxels / kBrickSide)); }

/// A number of bricks beyond which a support does not reach from its center's brick.
int reachOf(const Ellipsoid& p, double radius) {
  return bricksIn(radius * std::sqrt(ellipsoid_math::norm2(inverse(p.L))));
}

}  // namespace

bool Round::cancelled() const {
  const CancelToken* own = scene_.options.cancel;
  return CancelScope::cancelled() || (own && own->cancelled());
}

PartKey Round::keyOf(std::size_t part) const { return esvr::keyOf(scene_, startOf(part)); }

PartOutput Round::fit(std::size_t part, const Device& device) const {
  const PartStart start = startOf(part);
  const PartEnd end = cancelled() ? notFitted(start) : fitted(start, device);
  progress_.end(part, end, start.plan.to);
  return {bytesOf(end), end.end != FitEnd::kCancelled};
}

PartEnd Round::notFitted(const PartStart& start) const {
  PartEnd end = unchanged(scene_, start);
  end.end = FitEnd::kCancelled;
  return end;
}

PartEnd Round::fitted(const PartStart& start, const Device& device) const try {
  return fitPart(scene_, start, {device, turns_, progress_.of(start.chunk)});
} catch (const Cancelled&) {
  return notFitted(start);
}

PartStart Round::startOf(std::size_t chunk) const {
  PartStart start;
  start.chunk = chunk;
  start.kernel = plan_.kernel;
  start.plan = runPlanOf(chunk);
  takeAround(chunk, start);
  start.errors = states_[chunk].errors;
  start.pairs = states_[chunk].pairs;
  return start;
}

RunPlan Round::runPlanOf(std::size_t chunk) const {
  const ChunkState& state = states_[chunk];
  const FitOptions& options = scene_.options;
  RunPlan plan;
  plan.count = state.wanted;
  plan.firstCount = state.firstCount;
  plan.iterations = plannedIterations(options);
  plan.start = state.fit;
  plan.psnr = options.psnr;
  plan.from = kRoundEnds[plan_.number];
  plan.to = kRoundEnds[plan_.number + 1];
  plan.curve = false;
  plan.learnKappa = !options.kappa && plan.from < kKappaUntil;
  if (options.seconds)
    plan.seconds = *options.seconds * (plan.to - plan.from) * progress_.shareOf(chunk);
  return plan;
}

/// Takes the ellipsoids of the other chunks. Those in the halo are fitted too and dropped at the end
/// of the part. During the part they change as they do in the parts of their own chunks, because the
/// voxels and the first state are the same. The ellipsoids on both sides of a plane can therefore
/// adapt to each other although the parts do not communicate.
void Round::takeAround(std::size_t chunk, PartStart& start) const {
  const double radius = supportRadius(kernelConstants<double>(plan_.kernel));
  const Box halo = dilated(scene_.chunks[chunk].bounds, scene_.halo);
  const Box possible = dilated(halo, bricksIn(radius * Tuning{}.largestScale));
  double count = double(start.plan.count), firstCount = double(start.plan.firstCount);
  for (std::size_t other = 0; other < states_.size(); ++other) {
    if (other == chunk || common(possible, scene_.chunks[other].box).empty()) continue;
    const double share = takeFrom(other, {halo, possible, radius}, start);
    count += share * double(states_[other].wanted);
    firstCount += share * double(states_[other].firstCount);
  }
  start.plan.count = std::size_t(count);
  start.plan.firstCount = std::size_t(firstCount);
}

/// Takes the ellipsoids of another chunk that are in the halo or reach into it.
/// \return the share that is in the halo; before there are ellipsoids, that of the active voxels
double Round::takeFrom(std::size_t other, const Halo& halo, PartStart& start) const {
  const FitState& fit = states_[other].fit;
  if (fit.ellipsoids.empty()) return shareWithin(halo.box, scene_.chunks[other]);
  std::size_t inside = 0;
  for (std::size_t i = 0; i < fit.ellipsoids.size(); ++i) {
    const Ellipsoid& p = fit.ellipsoids[i];
    const Coord brick = brickWith(p);
    if (!halo.possible.contains(brick)) continue;
    if (halo.box.contains(brick)) {
      start.plan.start.ellipsoids.push_back(p);
      start.plan.start.adam.push_back(fit.adam[i]);
      ++inside;
    } else if (dilated(halo.box, reachOf(p, halo.radius)).contains(brick)) {
      start.ghosts.push_back(p);
    }
  }
  return double(inside) / double(fit.ellipsoids.size());
}

/// The share of a chunk's active voxels in a box of bricks.
double Round::shareWithin(const Box& box, const BrickChunk& chunk) const {
  std::uint64_t active = 0;
  if (common(box, chunk.bounds).empty()) return 0.0;
  for (const std::uint32_t b : chunk.bricks)
    if (box.contains(scene_.volume.bricks[b]))
      active += std::uint64_t(scene_.volume.active[b].count());
  return double(active) / double(chunk.activeVoxels);
}

}  // namespace esvr
