#include <algorithm>
#include <cmath>
#include <memory>

#include "fit/chunks/part.h"
#include "fit/fit_plan.h"
#include "fit/optimiser.h"
#include "fit/recorder.h"

namespace esvr {
namespace {

bool isZero(const FitTarget& target) {
  return std::all_of(target.values.begin(), target.values.end(), [](float v) { return v == 0.0f; });
}

/// The ellipsoids in a chunk's box.
FitState within(const Box& box, const FitState& all) {
  FitState kept;
  for (std::size_t i = 0; i < all.ellipsoids.size(); ++i) {
    if (!box.contains(brickWith(all.ellipsoids[i]))) continue;
    kept.ellipsoids.push_back(all.ellipsoids[i]);
    kept.adam.push_back(all.adam[i]);
  }
  return kept;
}

OptimiserOptions optimiserOptions(const FitOptions& options, const PartStart& start,
                                  const Device& device) {
  constexpr int kChunkBits = 40;  // above those by which an optimiser varies its seed
  const std::uint64_t seed = options.seed ^ (std::uint64_t(start.chunk + 1) << kChunkBits);
  return {start.kernel, seed, device, options.maxDeviceBytes};
}

PartEnd endOf(Optimiser& optimiser, const RunEnd& run, const PartStart& start, const Box& box) {
  const BestSoFar completion;
  PartEnd end;
  if (start.plan.to == 1.0 && run.end != FitEnd::kCancelled) optimiser.dropUnseen();
  end.errors = optimiser.measure();
  end.fit = within(box, optimiser.state());
  end.kernel = optimiser.kernel();
  end.pairs = optimiser.pairCount();
  end.end = run.end;
  end.iterations = run.iterations;
  end.deviceBytes = optimiser.deviceBytes();
  end.deviceFull = optimiser.deviceFull();
  end.secondsSeed = optimiser.secondsSeeding();
  return end;
}

}  // namespace

Coord brickWith(const Ellipsoid& p) {
  const auto brick = [](double v) { return std::int32_t(std::floor(v / kBrickSide)); };
  return {brick(p.center[0]), brick(p.center[1]), brick(p.center[2])};
}

PartEnd fitPart(const FitScene& scene, const PartStart& start, const PartPlace& place) {
  const BrickChunk& chunk = scene.chunks[start.chunk];
  ChunkTarget part;
  makeChunkTarget(scene, chunk, {start.ghosts, start.kernel}, part);
  if (isZero(part.target) || start.plan.count == 0) return unchanged(scene, start);
  applyOptions(scene.options, part.target);
  CommonFitOptions options = scene.options;
  options.progress = place.progress;
  const Tuning tuning;
  const auto turn = place.turns.take(place.device);
  Recorder recorder(part.target, options);
  const auto optimiser =
      makeOptimiser(part.target, optimiserOptions(scene.options, start, place.device), tuning);
  const RunEnd end = run(*optimiser, part.target, recorder, start.plan, tuning);
  return endOf(*optimiser, end, start, chunk.box);
}

PartEnd unchanged(const FitScene& scene, const PartStart& start) {
  PartEnd end;
  end.fit = within(scene.chunks[start.chunk].box, start.plan.start);
  end.kernel = start.kernel;
  end.errors = start.errors;
  end.pairs = start.pairs;
  return end;
}

}  // namespace esvr
