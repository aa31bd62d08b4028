#include "convert/voxel_trials.h"

#include <tbb/parallel_sort.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

#include "convert/octave_search.h"
#include "convert/unless_cancelled.h"
#include "core/parallel.h"
#include "esvr/grid_coding.h"

namespace esvr::convert {
namespace {

constexpr double kPsnrTolerance = 0.05;  // dB above the wanted PSNR that end a search
/// Share of the errors of the frame before that voxels keep. On a fire and a gas, 0 takes fewer bytes
/// and flickers; a half and more takes many bytes for little less flicker (docs/lab-notes.md).
constexpr double kErrorsKept = 0.25;

/// Share of the active voxels with the most frequent value from which on it is a plateau.
constexpr double kPlateauShare = 0.02;
/// Largest number of voxels that the trials in memory have together.
constexpr std::size_t kVoxelsAtOnce = std::size_t{1} << 25;

Plateau plateauOf(const SparseVolume& volume) {
  std::vector<float> values;
  for (std::size_t i = 0; i < volume.values.size(); ++i)
    if (volume.active[i / kBrickVoxels].test(int(i % kBrickVoxels)))
      values.push_back(volume.values[i]);
  tbb::parallel_sort(values.begin(), values.end());
  Plateau plateau;
  for (auto from = values.begin(); from != values.end();) {
    const auto to = std::upper_bound(from, values.end(), *from);
    const double share = double(to - from) / double(values.size());
    if (*from != 0.0f && *from != volume.background && share > plateau.share)
      plateau = {std::abs(double(*from)), share};
    from = to;
  }
  return plateau;
}

}  // namespace

VoxelCandidate candidateOf(const Job& job, VoxelLayer layer, double psnr) {
  VoxelCandidate made;
  made.grid = makeStoredVoxels(job.input.descriptor, job.input.source, std::move(layer));
  made.bytes = bytesInFrame(made.grid, job.options.previous);
  made.psnr = psnr;
  return made;
}

VoxelTrials::VoxelTrials(const Job& job)
    : job_(job), plateau_(timed([&] { return plateauOf(job.input.source); })) {
  range_ = spanOf(job.input.source).length();
}

bool VoxelTrials::isPlateau() const { return plateau_.share >= kPlateauShare; }

double VoxelTrials::levelsOf(double bound) const {
  return std::max(std::round(0.5 * plateau_.value / bound), 1.0);
}

VoxelLayer VoxelTrials::nearestAt(double bound) const {
  return boundedLayer(job_.input.source, bound, voxelActivity(job_), voxelSigns(job_),
                      job_.input.simplified);
}

ThriftOptions VoxelTrials::thriftOf(double price) const {
  const StoredGrid* previous = job_.options.previous;
  const VoxelLayer* layer = previous && previous->voxels ? &*previous->voxels : nullptr;
  return {price, layer, job_.options.keepsPastErrors ? kErrorsKept : 0.0, voxelSigns(job_)};
}

Trial VoxelTrials::tryBound(double bound, double price) const {
  VoxelLayer layer = nearestAt(bound);
  if (price > 0.0) layer = thriftyLayer(job_.input.source, std::move(layer), thriftOf(price)).layer;
  SparseVolume made = volumeOf(layer);
  if (decodedValues(job_) == DecodedValues::kHalfs) roundToHalfs(made);
  const double psnr = psnrOf(job_, made);
  return {bound, psnr, std::move(layer)};
}

std::optional<Trial> VoxelTrials::coarsestFor(double psnr, double firstOctave, double price,
                                              int maxTrials) const {
  OctaveSearch search(psnr + 0.3 * kPsnrTolerance, kDbPerOctave, firstOctave);
  std::optional<Trial> best;
  for (int n = 0; n < maxTrials && !search.ended(); ++n) {
    auto now = unlessCancelled(
        [&]() -> std::optional<Trial> { return tryBound(boundAt(search.next()), price); });
    if (!now && best) break;
    if (!now) throw Cancelled();
    search.learn(now->psnr);
    if (now->psnr >= psnr && (!best || now->bound > best->bound)) best = std::move(*now);
    if (best && best->psnr < psnr + kPsnrTolerance) break;
  }
  return best;
}

std::optional<Trial> VoxelTrials::nearestFor(double psnr) const {
  return coarsestFor(psnr, psnr / kDbPerOctave - 1.0, 0.0, kMaxTrials);
}

double VoxelTrials::fewestLevels(double psnr, double bound) const {
  const auto reaches = [&](double levels) { return tryBound(boundOf(levels), 0.0).psnr >= psnr; };
  double enough = levelsOf(bound) + 1.0;
  if (!reaches(enough)) return 0.0;
  double tooFew = std::max(std::floor(0.5 * enough) - 1.0, 0.0);
  while (enough - tooFew > 1.0) {
    const double middle = std::floor(0.5 * (tooFew + enough));
    (reaches(middle) ? enough : tooFew) = middle;
  }
  return enough;
}

int VoxelTrials::trialsAtOnce() const {
  const std::size_t voxels = std::max<std::size_t>(job_.input.source.values.size(), 1);
  const auto most = std::size_t(tbb::this_task_arena::max_concurrency());
  return int(std::clamp<std::size_t>(kVoxelsAtOnce / voxels, 1, most));
}

}  // namespace esvr::convert
