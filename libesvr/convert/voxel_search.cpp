#include "convert/voxel_search.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>
#include <tbb/parallel_sort.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "convert/octave_search.h"
#include "core/add_seconds.h"
#include "esvr/frame_coding.h"
#include "esvr/grid_coding.h"
#include "esvr/voxel_layer.h"

namespace esvr::convert {
namespace {

constexpr double kDbPerOctave = 6.02;        // gain of PSNR by half the bound
constexpr double kDoublingsPerOctave = 0.5;  // usual growth of the bytes by half the bound
constexpr double kPsnrTolerance = 0.05;      // dB above the wanted PSNR that end a search
constexpr double kSizeTolerance = 0.01;      // share of the bytes that may stay unused
constexpr int kMaxTrials = 10;

/// Prices of a bit (thriftyLayer). kPrice is the best one at 40 to 60 dB on the volumes of
/// docs/lab-notes.md, "Voxel coding": 0.05 gives files that are up to 1 % larger, 0.12 up to 5 %.
/// Where the bound cannot be chosen freely, higher prices use up the PSNR that is left.
constexpr double kPrice = 0.08;
/// The same for frames that are predicted: with a steadiness of 0, and what steadiness adds. Voxels
/// whose bits are not worth their price keep to the prediction, and so to the frame before.
constexpr double kFramePrice = 0.14, kSteadyPrice = 0.12;
constexpr double kErrorsKept = 0.5;  // share of the errors of the frame before with steadiness 1
constexpr std::array kPlateauPrices{0.0, 0.08, 0.12, 0.2, 0.3};
constexpr double kThriftOctaves = 0.08;  // bound's octaves that make up for the loss by kPrice
constexpr int kMaxThriftyTrials = 4, kMaxFrameTrials = 10;
/// Bits of an active voxel of a frame from which on exact voxels are tried, which take 8 at least in
/// all but constant volumes.
constexpr double kBitsOfExact = 8.0;

/// Share of the active voxels with the most frequent value from which on a lattice that has this
/// value, so that these voxels are exact, is tried.
constexpr double kPlateauShare = 0.02;
/// Largest number of voxels that the trials in memory have together.
constexpr std::size_t kVoxelsAtOnce = std::size_t{1} << 25;
constexpr int kMaxLevels = 24;  // coarser lattices than the first that are tried for a plateau

VoxelCandidate candidate(const Job& job, VoxelLayer layer, double psnr) {
  VoxelCandidate made;
  made.grid = makeStoredVoxels(job.input.descriptor, job.input.source, std::move(layer));
  made.bytes = bytesInFrame(made.grid, job.options.previous);
  made.psnr = psnr;
  return made;
}

/// The most frequent value of the active voxels besides 0 and the background, which are exact
/// anyway, the share of voxels that have it, and the seconds that counting them took.
struct Plateau {
  double value = 0.0, share = 0.0, seconds = 0.0;
};

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

/// The result of `make`, whose member `seconds` says how long making it took.
template <class Make>
auto timed(const Make& make) {
  double seconds = 0.0;
  auto made = addSeconds(seconds, make);
  made.seconds = seconds;
  return made;
}

bool isSmaller(const VoxelCandidate& a, const VoxelCandidate& b) { return a.bytes < b.bytes; }
bool isCloser(const VoxelCandidate& a, const VoxelCandidate& b) { return a.psnr > b.psnr; }

/// Voxels on a lattice without and with the plateau, and the seconds that the latter took.
struct PlateauTrial {
  std::optional<VoxelCandidate> without, with{};
  double seconds = 0.0;

  /// The better ones, with a record of the decision.
  template <class Better>
  std::optional<VoxelCandidate> decide(const Better& better) && {
    Decision decision{.tried = true, .seconds = seconds};
    if (without) decision.bytesWithout = without->bytes;
    if (with) decision.bytesWith = with->bytes;
    decision.used = with && (!without || better(*with, *without));
    auto& best = decision.used ? with : without;
    if (best) best->plateau = decision;
    return std::move(best);
  }
};

/// A layer, its bound and its PSNR.
struct Trial {
  double bound, psnr;
  VoxelLayer layer;
};

class VoxelSearch {
 public:
  explicit VoxelSearch(const Job& job)
      : job_(job), plateau_(timed([&] { return plateauOf(job.input.source); })) {
    const ValueRange range = activeRange(job.input.source);
    const double background = job.input.source.background;
    range_ = std::max(double(range.max), background) - std::min(double(range.min), background);
  }

  VoxelCandidate forPsnr(const PsnrTarget& target) const {
    const double psnr = target.psnr;
    if (!(range_ > 0.0)) return exactVoxels(job_);
    auto plain = coarsestFor(psnr, psnr / kDbPerOctave - 1.0, 0.0, kMaxTrials);
    if (!plain) return exactVoxels(job_);
    const double bound = plain->bound;
    if (job_.options.previous) return predictedFor(psnr, std::move(*plain));
    VoxelCandidate best;
    tbb::task_arena arena(trialsAtOnce());
    arena.execute([&] {
      best = exactUnless(std::move(*plain));
      if (best.bytes >= target.smallEnough) best = furtherTrials(psnr, bound, std::move(best));
    });
    if (!best.plateau.tried) best.plateau.seconds = plateau_.seconds;
    return best;
  }

  /// The best quantised voxels of a size.
  std::optional<VoxelCandidate> forSize(std::uint64_t bytes) const {
    if (!(range_ > 0.0)) return std::nullopt;
    PlateauTrial trial{.without = fullest(bytes, false), .seconds = plateau_.seconds};
    if (trial.without) trial.without->plateau.seconds = trial.seconds;
    if (!isPlateau()) return std::move(trial.without);
    trial.with = addSeconds(trial.seconds, [&] { return fullest(bytes, true); });
    return std::move(trial).decide(isCloser);
  }

 private:
  [[nodiscard]] bool isPlateau() const { return plateau_.share >= kPlateauShare; }
  [[nodiscard]] double boundAt(double octave) const { return range_ * std::exp2(-octave); }
  [[nodiscard]] double octaveOf(double bound) const { return std::log2(range_ / bound); }

  /// The bound of a lattice that has `levels` steps from 0 to the plateau.
  [[nodiscard]] double boundOf(double levels) const { return 0.5 * plateau_.value / levels; }
  [[nodiscard]] double levelsOf(double bound) const {
    return std::max(std::round(0.5 * plateau_.value / bound), 1.0);
  }

  [[nodiscard]] VoxelLayer layerAt(double bound, double price) const {
    const SparseVolume& source = job_.input.source;
    VoxelLayer layer =
        boundedLayer(source, bound, voxelActivity(job_), voxelSigns(job_), job_.input.simplified);
    return price > 0.0 ? thriftyLayer(source, std::move(layer), thriftOf(price)) : layer;
  }

  [[nodiscard]] ThriftOptions thriftOf(double price) const {
    const StoredGrid* previous = job_.options.previous;
    const VoxelLayer* layer = previous && previous->voxels ? &*previous->voxels : nullptr;
    return {price, layer, kErrorsKept * job_.options.steadiness, voxelSigns(job_)};
  }

  [[nodiscard]] Trial tryBound(double bound, double price) const {
    VoxelLayer layer = layerAt(bound, price);
    const double psnr = psnrOf(job_, volumeOf(layer));
    return {bound, psnr, std::move(layer)};
  }

  [[nodiscard]] std::optional<VoxelCandidate> candidateOf(std::optional<Trial> trial) const {
    if (!trial) return std::nullopt;
    return candidate(job_, std::move(trial->layer), trial->psnr);
  }

  /// The coarsest trial found that reaches a PSNR.
  [[nodiscard]] std::optional<Trial> coarsestFor(double psnr, double firstOctave, double price,
                                                 int maxTrials) const {
    OctaveSearch search(psnr + 0.3 * kPsnrTolerance, kDbPerOctave, firstOctave);
    std::optional<Trial> best;
    for (int n = 0; n < maxTrials && !search.ended(); ++n) {
      Trial now = tryBound(boundAt(search.next()), price);
      search.learn(now.psnr);
      if (now.psnr >= psnr && (!best || now.bound > best->bound)) best = std::move(now);
      if (best && best->psnr < psnr + kPsnrTolerance) break;
    }
    return best;
  }

  [[nodiscard]] double framePrice() const {
    return kFramePrice + kSteadyPrice * job_.options.steadiness;
  }

  /// Thrifty voxels of a frame, or the trial if they do not reach the PSNR. Exact voxels are tried
  /// only if these take so many bits that exact ones may take fewer.
  [[nodiscard]] VoxelCandidate predictedFor(double psnr, Trial plain) const {
    const double octave = octaveOf(plain.bound) + framePrice();
    auto thrifty = coarsestFor(psnr, octave, framePrice(), kMaxFrameTrials);
    VoxelCandidate best = *candidateOf(std::move(thrifty ? *thrifty : plain));
    const double bits = 8.0 * double(best.bytes) / double(activeVoxelCount(job_.input.source));
    if (bits < kBitsOfExact) return best;
    VoxelCandidate exact = exactVoxels(job_);
    return isSmaller(best, exact) ? std::move(best) : std::move(exact);
  }

  /// Exact voxels, unless the trial is smaller.
  [[nodiscard]] VoxelCandidate exactUnless(Trial trial) const {
    VoxelCandidate exact, rounded;
    tbb::parallel_invoke([&] { exact = exactVoxels(job_); },
                         [&] { rounded = candidate(job_, std::move(trial.layer), trial.psnr); });
    return isSmaller(rounded, exact) ? std::move(rounded) : std::move(exact);
  }

  /// The smallest of `best`, thrifty voxels of about the same bound, and voxels with the plateau.
  [[nodiscard]] VoxelCandidate furtherTrials(double psnr, double bound, VoxelCandidate best) const {
    std::optional<VoxelCandidate> thrifty;
    PlateauTrial trial{.without{}, .seconds = plateau_.seconds};
    const double octave = octaveOf(bound) + kThriftOctaves;
    tbb::parallel_invoke(
        [&] { thrifty = candidateOf(coarsestFor(psnr, octave, kPrice, kMaxThriftyTrials)); },
        [&] {
          if (!isPlateau()) return;
          trial.with = addSeconds(trial.seconds, [&] { return withPlateau(psnr, bound); });
        });
    if (thrifty && isSmaller(*thrifty, best)) best = std::move(*thrifty);
    if (!isPlateau()) return best;
    trial.without = std::move(best);
    return *std::move(trial).decide(isSmaller);
  }

  /// The smallest number of levels in [to, from] that reaches a PSNR; 0 if there is none.
  [[nodiscard]] double fewestLevels(double psnr, std::size_t from, std::size_t to) const {
    std::vector<char> reaches(from + 1 - to);
    const auto tryLevels = [&](std::size_t n) {
      reaches[n] = tryBound(boundOf(double(to + n)), 0.0).psnr >= psnr;
    };
    tbb::task_arena arena(trialsAtOnce());
    arena.execute([&] { tbb::parallel_for(std::size_t{0}, reaches.size(), tryLevels); });
    const auto first = std::find(reaches.begin(), reaches.end(), true);
    return first == reaches.end() ? 0.0 : double(to + std::size_t(first - reaches.begin()));
  }

  /// The number of trials that may be in memory at once.
  [[nodiscard]] int trialsAtOnce() const {
    const std::size_t voxels = std::max<std::size_t>(job_.input.source.values.size(), 1);
    const auto most = std::size_t(tbb::this_task_arena::max_concurrency());
    return int(std::clamp<std::size_t>(kVoxelsAtOnce / voxels, 1, most));
  }

  /// The coarsest lattice found that has the value of the plateau and reaches a PSNR. The PSNR is
  /// not monotone in the number of levels, since there may be other plateaus.
  [[nodiscard]] std::optional<VoxelCandidate> withPlateau(double psnr, double bound) const {
    const double from = levelsOf(bound) + 1.0;
    const double to = std::max(std::floor(0.5 * from), std::max(from - kMaxLevels, 1.0));
    const double found = fewestLevels(psnr, std::size_t(from), std::size_t(to));
    if (found == 0.0) return std::nullopt;
    std::array<std::optional<VoxelCandidate>, kPlateauPrices.size()> made;
    tbb::parallel_for(std::size_t{0}, made.size(), [&](std::size_t k) {
      Trial trial = tryBound(boundOf(found), kPlateauPrices[k]);
      if (trial.psnr >= psnr) made[k] = candidate(job_, std::move(trial.layer), trial.psnr);
    });
    const auto larger = [](const auto& a, const auto& b) {
      return a && (!b || a->bytes < b->bytes);
    };
    return std::move(*std::min_element(made.begin(), made.end(), larger));
  }

  /// The best voxels found that keep to a size. With plateaus, the largest are not always the best.
  [[nodiscard]] std::optional<VoxelCandidate> fullest(std::uint64_t bytes, bool plateau) const {
    const double aim = std::log2((1.0 - 0.3 * kSizeTolerance) * double(bytes));
    const double bits = 8.0 * double(bytes) / double(activeVoxelCount(job_.input.source));
    OctaveSearch search(aim, kDoublingsPerOctave, 2.0 + bits);
    std::optional<VoxelCandidate> best;
    for (int n = 0; n < kMaxTrials && !search.ended(); ++n) {
      double bound = boundAt(search.next());
      if (plateau) bound = boundOf(levelsOf(bound));
      VoxelCandidate now = candidate(job_, layerAt(bound, kPrice), 0.0);
      search.learn(std::log2(double(now.bytes)));
      if (now.bytes > bytes) continue;
      const bool full = double(now.bytes) >= (1.0 - kSizeTolerance) * double(bytes);
      now.psnr = psnrOf(job_, now.grid);
      if (!best || now.psnr > best->psnr) best = std::move(now);
      if (full) break;
    }
    return best;
  }

  const Job& job_;
  Plateau plateau_;
  double range_ = 0.0;
};

}  // namespace

VoxelCandidate exactVoxels(const Job& job) {
  return timed([&] {
    return candidate(job, exactLayer(job.input.source), std::numeric_limits<double>::infinity());
  });
}

VoxelCandidate voxelsForPsnr(const Job& job, const PsnrTarget& target) {
  return timed([&] { return VoxelSearch(job).forPsnr(target); });
}

std::optional<VoxelCandidate> voxelsForSize(const Job& job, std::uint64_t bytes) {
  double seconds = 0.0;
  auto found = addSeconds(seconds, [&]() -> std::optional<VoxelCandidate> {
    auto exact = exactVoxels(job);
    if (exact.bytes <= bytes) return exact;
    return VoxelSearch(job).forSize(bytes);
  });
  if (found) found->seconds = seconds;
  return found;
}

}  // namespace esvr::convert
