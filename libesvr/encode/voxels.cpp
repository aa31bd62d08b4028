#include "encode/voxels.h"

#include <tbb/parallel_sort.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>
#include <vector>

#include "codec/brick_coder.h"
#include "core/add_seconds.h"
#include "core/parallel.h"
#include "encode/root_search.h"
#include "encode/tone.h"
#include "esvr/grid_coding.h"
#include "esvr/metrics.h"
#include "format/section_table.h"
#include "format/voxel_sections.h"

namespace esvr::encode {

// ---- Properties of a job's voxels

Activity voxelActivity(const Job& job) {
  const bool levelSet = job.input.descriptor.gridClass == GridClass::kLevelSet;
  return levelSet ? Activity::kExact : job.options.storage.activity;
}

RoundedSigns voxelSigns(const Job& job) {
  const bool hasSides = job.input.descriptor.gridClass == GridClass::kLevelSet;
  return hasSides ? RoundedSigns::kKept : RoundedSigns::kMayChange;
}

DecodedValues decodedValues(const Job& job) {
  return job.input.descriptor.valueType == ValueType::kHalf ? DecodedValues::kHalfs
                                                            : DecodedValues::kFloats;
}

// ---- The sample

std::vector<std::size_t> sampledBricks(const std::vector<Coord>& bricks, std::size_t count) {
  constexpr std::size_t kBricksOfRun = 64;
  const std::size_t runs = std::max<std::size_t>(count / kBricksOfRun, 1);
  const auto order = codec::codingOrder(bricks);
  const std::size_t length = count / runs, last = order.size() - length;
  std::vector<std::size_t> chosen;
  for (std::size_t run = 0; run < runs; ++run) {
    const auto first = std::ptrdiff_t(runs > 1 ? run * last / (runs - 1) : last / 2);
    chosen.insert(chosen.end(), order.begin() + first,
                  order.begin() + first + std::ptrdiff_t(length));
  }
  std::sort(chosen.begin(), chosen.end());
  chosen.erase(std::unique(chosen.begin(), chosen.end()), chosen.end());
  return chosen;
}

SparseVolume sampleOf(const SparseVolume& volume, std::size_t bricks) {
  if (volume.brickCount() <= bricks) return volume;
  SparseVolume sample;
  sample.origin = volume.origin;
  sample.background = volume.background;
  for (const std::size_t b : sampledBricks(volume.bricks, bricks)) {
    const auto values = volume.brickValues(b);
    sample.bricks.push_back(volume.bricks[b]);
    sample.active.push_back(volume.active[b]);
    sample.values.insert(sample.values.end(), values.begin(), values.end());
  }
  return sample;
}

namespace {

/// A volume is sampled from this many times the bricks of a sample. A smaller one is tried as a whole,
/// so that it is coded once.
constexpr std::size_t kSampledFrom = 4;

SparseVolume sampleFor(const Job& job, const SparseVolume& source, std::size_t bricks) {
  const bool isLarge = source.brickCount() >= kSampledFrom * bricks;
  // A frame is predicted from all bricks of the frame before.
  if (!isLarge || job.options.previous) return {};
  return sampleOf(source, bricks);
}

/// Share of the active voxels with one value from which on a lattice that contains it is tried.
constexpr double kPlateauShare = 0.02;

/// \param stride  one of so many voxels counts
Plateau plateauOf(const SparseVolume& volume, std::size_t stride) {
  std::vector<float> values;
  for (std::size_t i = 0; i < volume.values.size(); i += stride)
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

/// The most frequent value. Of a large volume, one of 13 voxels is looked at first: 13 is prime to the side of a brick.
Plateau plateauOf(const SparseVolume& volume) {
  constexpr std::size_t kManyValues = std::size_t{1} << 19, kStride = 13;
  if (volume.values.size() >= kManyValues)
    if (const Plateau seen = plateauOf(volume, kStride); seen.share < 0.5 * kPlateauShare)
      return seen;
  return plateauOf(volume, 1);
}

/// About the bits that the voxels of a volume take within a bound: the logarithm of the differences of
/// neighbours in steps. Bricks differ much, so that the bytes of a sample are scaled by this number and
/// not by that of the bricks.
double complexityOf(const SparseVolume& volume, double bound) {
  constexpr double kLeast = 0.02;  // bits of a voxel that is predicted exactly
  std::vector<double> bits(volume.brickCount());
  parallelFor(std::size_t{0}, bits.size(), [&](std::size_t b) {
    const auto values = volume.brickValues(b);
    float sum = 0.0f;
    for (std::size_t v = 1; v < kBrickVoxels; ++v)
      sum += std::log2(1.0f + float(std::abs(double(values[v]) - values[v - 1]) / (2.0 * bound)));
    bits[b] = double(sum) + kLeast * kBrickVoxels;
  });
  return std::accumulate(bits.begin(), bits.end(), 0.0);
}

/// Bytes of a layer's section without its palette, which a sample has as a whole.
double bytesOfCodes(VoxelLayer& layer) {
  return double(format::keepCoded(layer)) - double(layer.palette.size() * sizeof(float));
}

/// Bytes that a grid of voxels adds to a file besides those of its voxels, with padding.
std::uint64_t bytesBeside(const Job& job) {
  const std::uint64_t empty = format::putVoxels({}).size();
  return bytesAdded(makeStoredVoxels(job.input.descriptor, job.input.source, {})) - empty +
         format::kAlignment;
}

/// The bytes of exact voxels of a volume, from those of a sample.
std::uint64_t exactBytesOf(const SparseVolume& sample, const SparseVolume& whole) {
  VoxelLayer layer = smallestExactLayer(sample);
  const double bound = spanOf(whole).length() * 0x1p-14;
  const bool isWhole = sample.brickCount() == whole.brickCount() || !(bound > 0.0);
  const double share = isWhole ? double(sample.brickCount()) / double(whole.brickCount())
                               : complexityOf(sample, bound) / complexityOf(whole, bound);
  return std::uint64_t(bytesOfCodes(layer) / share) + layer.palette.size() * sizeof(float);
}

/// Bits of an active voxel from which on exact voxels may be as small, by the form of these: a palette
/// takes any number of bits, and the last bits of half floats and floats are noise.
double leastBitsOfExact(VoxelForm form) {
  return form == VoxelForm::kPalette ? 0.0 : form == VoxelForm::kHalf ? 5.0 : 12.0;
}

/// Price of a bit (ThriftOptions): 0.05 gives files that are up to 1 % larger at 40 to 60 dB, 0.12 up to 5 % (Lab, "Voxel
/// coding"). For voxels that are predicted from another grid or from the frame before, those whose bits are not worth
/// their price keep to the prediction; in a frame this also means less flicker. Of tones, 0.12 instead of 0.08 gains 0.2 dB
/// of what is seen of smoke1 in 65 KB and 0.5 dB of the plume in 156 KB.
constexpr double kPrice = 0.08, kPredictedPrice = 0.14, kFramePrice = 0.2, kTonedPrice = 0.12;
/// The price of the error of a brick where a volume is judged by what is seen (ThriftOptions::massPrice).
constexpr double kMassPrice = 0.012;
/// Share of the errors of the frame before that voxels keep. On a fire and a gas, 0 takes fewer bytes and flickers; a half
/// and more takes many bytes for little less flicker.
constexpr double kErrorsKept = 0.25;
/// The least bytes of thrifty voxels relative to those of the nearest codes (0.74 to 1.26 in 30 grids), and the factor of the
/// bytes that ellipsoids are expected to take above which thrifty ones are not searched for: the expected number of ellipsoids
/// is 0.7 to 1.5 times the final one.
constexpr double kThriftyShare = 0.7, kFarBehind = 2.5;
/// Exact voxels are stored if they take at most this factor of the bytes of the best other grid for a PSNR, or these
/// bytes more.
constexpr double kExactFactor = 1.03;
constexpr std::uint64_t kExactBytes = 64;

// Bounds are counted in octaves below the span of the values: 1 is half the span.
constexpr double kCoarsest = 1.0, kFinest = 24.0;  // float32 has 24 bits
constexpr double kNarrowest = 0.002;               // a bound that differs by 0.14 % is not tried
constexpr double kDbPerOctave = 6.02;              // gain of PSNR by half the bound
constexpr double kDoublingsPerOctave = 0.5;        // usual growth of the bytes by half the bound
constexpr double kThriftOctaves = 0.08;            // make up for the loss by a price
constexpr double kOctaveOfSize = 6.0;              // a usual one

// Trials of a search. Each nearest one takes a pass over the voxels, and each thrifty one as long as
// coding them.
constexpr int kNearestTrials = 14, kThriftyTrials = 6, kFrameTrials = 8, kSizeTrials = 8,
              kPlateauTrials = 4;
/// dB above a PSNR that end a search on the sample, and on the whole volume.
constexpr double kPsnrTolerance = 0.05, kFinalTolerance = 0.08;
/// Levels of a plateau from which on a lattice that contains it is fine enough for any PSNR, so that no other one is
/// tried. Without it, the PSNR jumps with the bound.
constexpr double kFineLevels = 4.0;
/// Share of a size that may stay unused.
constexpr double kSizeTolerance = 0.01;
/// Share of a size above which no jump of the bytes keeps voxels from using all of it.
constexpr double kShareOfJump = 0.97;
/// Factor by which codes may exceed a size before a trial ends. While codes are chosen, the coder's
/// parameters are those of the nearest codes, which can take a few more bytes.
constexpr double kCodesBeyondSize = 1.1;
/// Where the bound cannot be chosen freely, higher prices use up the PSNR or the bytes that are left.
constexpr std::array kPlateauPrices{0.08, 0.12, 0.2, 0.3};

RootRange octaves() { return {kCoarsest, kFinest, kNarrowest}; }

}  // namespace

Candidate estimateExactVoxels(const Job& job, std::size_t sampleBricks) {
  const SparseVolume& source = valuesOf(job);
  std::uint64_t bytes = 0;
  bool isSampled = false;
  const double seconds = secondsOf([&] {
    const SparseVolume sample = sampleFor(job, source, sampleBricks);
    isSampled = sample.brickCount() > 0;
    bytes = exactBytesOf(isSampled ? sample : source, source) + bytesBeside(job);
  });
  return {bytes, std::numeric_limits<double>::infinity(), isSampled, seconds};
}

namespace {

VoxelCandidate exactCandidate(const Job& job, VoxelLayer exact) {
  VoxelCandidate made;
  made.grid = makeStoredVoxels(job.input.descriptor, valuesOf(job), std::move(exact));
  made.bytes = bytesInFrame(made.grid, job.options.previous);
  made.psnr = std::numeric_limits<double>::infinity();
  return made;
}

}  // namespace

VoxelCandidate exactVoxels(const Job& job) {
  VoxelCandidate made;
  made.seconds = secondsOf([&] { made = exactCandidate(job, smallestExactLayer(valuesOf(job))); });
  return made;
}

std::optional<VoxelCandidate> smallerExactVoxels(const Job& job, const StoredGrid& quantised) {
  const VoxelLayer& layer = *quantised.voxels;
  if (layer.form != VoxelForm::kQuantised) return std::nullopt;
  // The coder predicts better than by one neighbour, which saves up to two bits.
  constexpr double kBetterPrediction = 2.0;
  double bits = 0.0, active = 1.0;
  for (std::size_t b = 0; b < layer.bricks.size(); ++b) {
    const std::int32_t* codes = &layer.codes[b * kBrickVoxels];
    for (int v = 1; v < kBrickVoxels; ++v)
      bits += std::log2(1.0 + std::abs(double(codes[v]) - codes[v - 1]));
    active += double(layer.active[b].count());
  }
  VoxelLayer exactCodes = smallestExactLayer(valuesOf(job));
  if (bits / active < leastBitsOfExact(exactCodes.form) - kBetterPrediction) return std::nullopt;
  VoxelCandidate exact = exactCandidate(job, std::move(exactCodes));
  if (exact.bytes > bytesInFrame(quantised, job.options.previous)) return std::nullopt;
  return exact;
}

// ---- Settings

VoxelSearch::VoxelSearch(const Job& job, const Aim& goal, std::size_t sampleBricks)
    : job_(job),
      goal_(goal),
      sampleBricks_(sampleBricks),
      box_(job.options.fit.box.value_or(activeBox(job.input.source))),
      peak_(job.options.fit.peak ? *job.options.fit.peak : peakOf(job.input.source)),
      sample_(sampleFor(job, job.input.source, sampleBricks)),
      tryOn_(sample_.brickCount() > 0 ? sample_ : job.input.source),
      share_(double(tryOn_.brickCount()) / double(job.input.source.brickCount())),
      range_(spanOf(job.input.source).length()),
      besides_(bytesBeside(job)) {
  seconds_ += secondsOf([&] { plateau_ = plateauOf(tryOn_); });
  if (!seesPictures(job)) return;
  mass_ = job.judge->mass();
  sampleMass_ = job.judge->massOf(sample_);
}

bool VoxelSearch::hasPlateau() const { return plateau_.share >= kPlateauShare; }

double VoxelSearch::price() const {
  if (!job_.options.previous) return isToned(job_) ? kTonedPrice : kPrice;
  return job_.options.keepsPastErrors ? kFramePrice : kPredictedPrice;
}

double VoxelSearch::boundOf(const Setting& setting) const {
  if (setting.levels > 0.0) return 0.5 * plateau_.value / setting.levels;
  return range_ * std::exp2(-setting.octave);
}

/// \param isSized  the work stops where codes clearly exceed the size (ThriftyLayer::tooMany)
ThriftyLayer VoxelSearch::layerOf(const SparseVolume& volume, const Setting& setting,
                                  bool isSized) const {
  const double bound = boundOf(setting);
  ThriftyLayer made{nearestLayer(volume, bound, voxelActivity(job_), voxelSigns(job_))};
  if (setting.price == 0.0) return made;
  const StoredGrid* previous = job_.options.previous;
  ThriftOptions thrift{setting.price, previous && previous->voxels ? &*previous->voxels : nullptr,
                       job_.options.keepsPastErrors ? kErrorsKept : 0.0, voxelSigns(job_),
                       isToned(job_) ? kMassPrice : 0.0};
  if (isSized) {
    const double left = double(*goal_.bytes - std::min(*goal_.bytes, besides_));
    thrift.mostBytes = std::uint64_t(kCodesBeyondSize * left * shareOfBytes(volume, bound));
  }
  made = thriftyLayer(volume, std::move(made.layer), thrift);
  if (seesPictures(job_) && !made.tooMany)
    made.layer.divisor /=
        job_.judge->massFactor(&volume == &sample_ ? sampleMass_ : mass_, volumeOf(made.layer));
  return made;
}

double VoxelSearch::shareOf(const SparseVolume& volume) const {
  return &volume == &tryOn_ ? share_ : 1.0;
}

double VoxelSearch::psnrOn(const SparseVolume& volume, const VoxelLayer& layer) const {
  SparseVolume made = volumeOf(layer);
  if (job_.judge && &volume == &job_.input.source) return (*job_.judge)(std::move(made)).quality;
  if (decodedValues(job_) == DecodedValues::kHalfs) roundToHalfs(made);
  forgiveFilled(volume, job_.options.filled, made);
  return psnrOverBox(volume, made, {.box = box_, .peak = peak_}) +
         10.0 * std::log10(shareOf(volume)) + judged_;
}

VoxelSearch::Tried VoxelSearch::tried(const SparseVolume& volume, const Setting& setting) const {
  Tried made{setting, layerOf(volume, setting).layer};
  made.psnr = psnrOn(volume, made.layer);
  return made;
}

/// The share of the bytes of the whole volume that a sample has at a bound.
double VoxelSearch::shareOfBytes(const SparseVolume& volume, double bound) const {
  if (&volume != &tryOn_ || !isSampled()) return 1.0;
  return complexityOf(volume, bound) / complexityOf(job_.input.source, bound);
}

std::uint64_t VoxelSearch::bytesOf(const SparseVolume& volume, VoxelLayer& layer,
                                   double bound) const {
  if (job_.options.previous)
    return bytesInFrame(makeStoredVoxels(job_.input.descriptor, job_.input.source, layer),
                        job_.options.previous);
  return std::uint64_t(bytesOfCodes(layer) / shareOfBytes(volume, bound)) +
         layer.palette.size() * sizeof(float) + besides_;
}

/// The coarsest trial found that reaches a PSNR; nothing if none does.
std::optional<VoxelSearch::Tried> VoxelSearch::coarsest(const SparseVolume& volume, double psnr,
                                                        const Setting& first, int mostTrials,
                                                        double tolerance) const {
  RootSearch search(octaves(), psnr + 0.3 * tolerance, kDbPerOctave, first.octave);
  std::optional<Tried> best;
  for (int n = 0; n < mostTrials && !search.ended(); ++n) {
    auto now = unlessCancelled([&]() -> std::optional<Tried> {
      return tried(volume, {search.next(), first.price});
    });
    if (!now && best) break;
    if (!now) throw Cancelled();
    search.learn(now->psnr);
    const bool isCoarser = !best || now->setting.octave < best->setting.octave;
    if (now->psnr >= psnr && isCoarser) best = std::move(now);
    if (best && best->psnr < psnr + tolerance) break;
  }
  return best;
}

// ---- A PSNR

/// The smallest voxels found whose lattice has the value of the plateau and that reach the PSNR. It grows with the
/// logarithm of the number of levels, though it need not be monotone where there are other plateaus.
std::optional<VoxelSearch::Tried> VoxelSearch::fewestLevels(const SparseVolume& volume,
                                                            const Setting& first, int mostTrials,
                                                            double tolerance) const {
  const double psnr = *goal_.psnr;
  std::optional<Tried> best;
  double tooFew = 0.0, enough = HUGE_VAL, levels = first.levels;
  for (int n = 0; n < mostTrials && enough - tooFew > 1.0; ++n) {
    Tried now = tried(volume, {.price = first.price, .levels = levels});
    const double over = now.psnr - psnr, wanted = levels * std::exp2(-over / kDbPerOctave);
    (over >= 0.0 ? enough : tooFew) = levels;
    if (over >= 0.0) best = std::move(now);
    if (over >= 0.0 && over <= tolerance) break;
    levels = std::clamp(std::isfinite(wanted) ? std::ceil(wanted) : tooFew + 1.0, tooFew + 1.0,
                        std::max(enough - 1.0, tooFew + 1.0));
  }
  // A higher price takes fewer bytes. Where one level less would lose many dB, another lattice is better.
  const bool isNear = best && best->psnr < psnr + kDbPerOctave;
  for (const double price : kPlateauPrices) {
    if (!isNear) break;
    if (price <= first.price) continue;
    Tried trial = tried(volume, {.price = price, .levels = enough});
    if (trial.psnr < psnr) break;
    best = std::move(trial);
  }
  return best;
}

double VoxelSearch::levelsOf(const Setting& setting) const {
  return std::max(std::round(0.5 * plateau_.value / boundOf(setting)), 1.0);
}

/// The coarsest thrifty voxels that reach a PSNR.
std::optional<VoxelSearch::Tried> VoxelSearch::thriftyForPsnr(const Tried& plain) const {
  const bool isFrame = job_.options.previous;
  const Setting first{plain.setting.octave + (isFrame ? price() : kThriftOctaves), price()};
  return coarsest(tryOn_, *goal_.psnr, first, isFrame ? kFrameTrials : kThriftyTrials,
                  kPsnrTolerance);
}

void VoxelSearch::tryForPsnr() {
  const double psnr = *goal_.psnr;
  if (exactIsBest()) return;
  const Setting first{psnr / kDbPerOctave - 1.0};
  std::optional<Tried> with;
  if (hasPlateau() && !job_.options.previous && range_ > 0.0) {
    with = fewestLevels(tryOn_, {.levels = levelsOf(first)}, kNearestTrials, 0.0);
    if (with) with->bytes = bytesOf(tryOn_, with->layer, boundOf(with->setting));
  }
  const bool isFine = with && with->setting.levels >= kFineLevels;
  if (!isFine && range_ > 0.0)
    best_ = coarsest(tryOn_, psnr, first, kNearestTrials, kPsnrTolerance);
  const auto countBytes = [&] {
    best_->bytes = bytesOf(tryOn_, best_->layer, boundOf(best_->setting));
  };
  if (best_ && !with && rival_) {
    countBytes();
    best_->bytes = std::uint64_t(kThriftyShare * double(best_->bytes));
    isFarBehind_ = double(best_->bytes) > kFarBehind * *rival_;
    if (isFarBehind_) return;
  }
  if (best_) {
    if (auto cheaper = thriftyForPsnr(*best_)) best_ = std::move(cheaper);
    countBytes();
  }
  considerPlateau(std::move(with));
  const double active = double(std::max<std::uint64_t>(activeVoxelCount(job_.input.source), 1));
  const double bits = best_ ? 8.0 * double(best_->bytes) / active : HUGE_VAL;
  if (!exact_ && bits >= leastBitsOfExact(smallestExactLayer(tryOn_).form))
    exact_ = job_.options.previous ? exactVoxels(job_).bytes : exactBytes();
}

/// True if exact voxels take hardly more bytes than their active mask, which all voxels of the grid need.
bool VoxelSearch::exactIsBest() {
  if (voxelActivity(job_) != Activity::kExact || job_.options.previous || isToned(job_))
    return false;
  VoxelLayer exact = smallestExactLayer(tryOn_);
  if (exact.form != VoxelForm::kPalette) return false;
  exact_ = exactBytes();
  VoxelLayer bare = exact;
  std::fill(bare.codes.begin(), bare.codes.end(), 0);
  const double least =
      bytesOfCodes(bare) / (bytesOfCodes(exact) / double(*exact_ - besides_)) + double(besides_);
  return double(*exact_) <= std::max(kExactFactor * least, least + double(kExactBytes));
}

/// Takes a lattice with the plateau where it is better.
void VoxelSearch::considerPlateau(std::optional<Tried> with) {
  const auto isBetter = [&](const Tried& a, const Tried& b) {
    return goal_.psnr ? a.bytes < b.bytes : a.psnr > b.psnr;
  };
  if (with && (!best_ || isBetter(*with, *best_))) best_ = std::move(with);
}

// ---- A size

/// Thrifty voxels of a setting; with bytes above the size if they are clearly too large, and without
/// layer and PSNR then.
std::optional<VoxelSearch::Tried> VoxelSearch::sized(const SparseVolume& volume,
                                                     const Setting& setting) const {
  const double bound = boundOf(setting);
  ThriftyLayer thrifty = layerOf(volume, setting, true);
  Tried made{setting, {}};
  if (thrifty.tooMany) {
    made.bytes =
        std::max(std::uint64_t(double(*thrifty.tooMany) / shareOfBytes(volume, bound)) + besides_,
                 *goal_.bytes + 1);
    return made;
  }
  made.layer = std::move(thrifty.layer);
  made.bytes = bytesOf(volume, made.layer, bound);
  if (made.bytes <= *goal_.bytes) made.psnr = psnrOn(volume, made.layer);
  return made;
}

/// The best voxels found that keep to the size. With plateaus, the largest are not always the best. Where the values are
/// integers, the bytes jump with the bound; voxels beyond the jump may keep to the size at a higher price.
std::optional<VoxelSearch::Tried> VoxelSearch::fullest(const SparseVolume& volume,
                                                       const Setting& first) const {
  const double bytes = double(*goal_.bytes);
  RootSearch search(octaves(), std::log2((1.0 - 0.3 * kSizeTolerance) * bytes), kDoublingsPerOctave,
                    first.octave);
  std::optional<Tried> best;
  std::optional<Setting> beyond;  // the coarsest setting that is too large
  bool isFull = false;
  const auto isLarge = [&](const Tried& trial, double share) {
    return double(trial.bytes) >= share * bytes;
  };
  for (int n = 0; n < kSizeTrials && !search.ended() && !isFull; ++n) {
    Setting setting{search.next(), first.price};
    if (first.levels > 0.0) setting.levels = levelsOf(setting);
    auto now = unlessCancelled([&] { return sized(volume, setting); });
    if (!now && best) return best;
    if (!now) throw Cancelled();
    search.learn(std::log2(double(now->bytes)));
    if (double(now->bytes) > bytes) {
      if (!beyond || setting.octave < beyond->octave) beyond = setting;
      continue;
    }
    isFull = isLarge(*now, 1.0 - kSizeTolerance);
    if (!best || now->psnr > best->psnr) best = std::move(now);
  }
  const bool isJump = beyond && (!best || !isLarge(*best, kShareOfJump));
  for (const double price : kPlateauPrices) {
    if (!isJump || price <= first.price) continue;
    beyond->price = price;
    auto now = unlessCancelled([&] { return sized(volume, *beyond); });
    if (!now) break;
    if (double(now->bytes) > bytes) continue;
    if (!best || now->psnr > best->psnr) best = std::move(now);
    break;
  }
  return best;
}

std::optional<Candidate> VoxelSearch::tooLargeFor(double psnr) {
  std::optional<Candidate> tooLarge;
  seconds_ += secondsOf([&] {
    if (job_.options.previous || !std::isfinite(psnr) || !(range_ > 0.0)) return;
    auto plain =
        coarsest(tryOn_, psnr, {psnr / kDbPerOctave - 1.0}, kNearestTrials, kPsnrTolerance);
    if (!plain || hasPlateau()) return;
    const auto made = sized(tryOn_, {plain->setting.octave, price()});
    const double margin = isSampled() ? kEstimateMargin : 1.0;
    if (double(made->bytes) > margin * double(*goal_.bytes))
      tooLarge = Candidate{made->bytes, plain->psnr, true};
  });
  if (tooLarge) tooLarge->seconds = seconds_;
  return tooLarge;
}

void VoxelSearch::tryForSize() {
  exact_ = exactBytes();
  if (!(range_ > 0.0)) return;
  const double active = double(std::max<std::uint64_t>(activeVoxelCount(job_.input.source), 1));
  const Setting first{2.0 + 8.0 * double(*goal_.bytes) / active, price()};
  best_ = fullest(tryOn_, first);
  if (!hasPlateau()) return;
  Setting setting = best_ ? best_->setting : first;
  setting.levels = 1.0;
  considerPlateau(best_ ? unlessCancelled([&] { return fullest(tryOn_, setting); })
                        : fullest(tryOn_, setting));
}

// ---- The result

std::uint64_t VoxelSearch::exactBytes() const {
  return estimateExactVoxels(job_, sampleBricks_).bytes;
}

/// A judge sees the volume as a whole. By how much its quality exceeds the PSNR of a sample is found with
/// the nearest codes of the whole volume, at a bound that has about the quality of the goal.
void VoxelSearch::matchJudge() {
  if (!job_.judge || !isSampled() || !(range_ > 0.0)) return;
  const SparseVolume& source = job_.input.source;
  double octave = goal_.psnr ? *goal_.psnr / kDbPerOctave - 1.0 : kOctaveOfSize;
  for (int n = 0; n < 2; ++n) {
    const VoxelLayer layer = layerOf(source, {.octave = octave}).layer;
    const double quality = psnrOn(source, layer);
    SparseVolume made = volumeOf(layer);
    forgiveFilled(source, job_.options.filled, made);
    judged_ = quality - psnrOverBox(source, made, {.box = box_, .peak = peak_});
    if (!std::isfinite(judged_)) judged_ = 0.0;
    if (!goal_.psnr || !std::isfinite(quality)) break;
    octave = std::clamp(octave + (*goal_.psnr - quality) / kDbPerOctave, kCoarsest, kFinest);
  }
}

void VoxelSearch::trySettings() {
  if (std::exchange(hasTried_, true)) return;
  seconds_ += secondsOf([&] {
    // On the whole volume, the first voxels that meet the goal are worth keeping.
    const auto end = unlessCancelled([&]() -> std::optional<bool> {
      matchJudge();
      goal_.psnr ? tryForPsnr() : tryForSize();
      return true;
    });
    if (!end && (isSampled() || !best_)) throw Cancelled();
  });
}

std::optional<Candidate> VoxelSearch::estimate(std::optional<double> rival) {
  rival_ = rival;
  trySettings();
  std::optional<Candidate> found;
  if (best_)
    found = Candidate{best_->bytes, goal_.psnr && isSampled() ? *goal_.psnr : best_->psnr,
                      isSampled() || isFarBehind_, seconds_};
  const std::uint64_t most = goal_.bytes ? *goal_.bytes : found ? found->bytes : UINT64_MAX;
  if (exact_ && *exact_ <= most)
    found = Candidate{*exact_, std::numeric_limits<double>::infinity(), isSampled(), seconds_};
  return found;
}

std::uint64_t VoxelSearch::likelyBytes(const Candidate& estimate) const {
  return isFarBehind_ ? std::uint64_t(double(estimate.bytes) / kThriftyShare) : estimate.bytes;
}

VoxelCandidate VoxelSearch::candidateOf(Tried tried) const {
  VoxelCandidate made;
  const BestSoFar completion;
  made.grid = makeStoredVoxels(job_.input.descriptor, job_.input.source, std::move(tried.layer));
  made.bytes = bytesInFrame(made.grid, job_.options.previous);
  made.psnr = tried.psnr;
  return made;
}

/// Quantised voxels of the whole volume with the setting that is best on the sample.
std::optional<VoxelCandidate> VoxelSearch::finished() {
  if (!best_) return std::nullopt;
  if (!isSampled()) return candidateOf(std::move(*best_));
  const SparseVolume& source = job_.input.source;
  const Setting setting = best_->setting;
  std::optional<Tried> found;
  if (goal_.bytes)
    found = fullest(source, setting);
  else if (setting.levels > 0.0)
    found = fewestLevels(source, setting, kPlateauTrials, kFinalTolerance);
  else
    found = coarsest(source, *goal_.psnr, setting, kThriftyTrials, kFinalTolerance);
  return found ? std::optional(candidateOf(std::move(*found))) : std::nullopt;
}

std::optional<VoxelCandidate> VoxelSearch::run() {
  rival_.reset();
  if (std::exchange(isFarBehind_, false)) hasTried_ = false, best_.reset();
  trySettings();
  std::optional<VoxelCandidate> found;
  seconds_ += secondsOf([&] {
    // Exact voxels of a size are the best ones, so that they are tried first.
    const double margin = kEstimateMargin;
    if (goal_.bytes && exact_ && double(*exact_) <= margin * double(*goal_.bytes)) {
      VoxelCandidate exact = exactVoxels(job_);
      if (exact.bytes <= *goal_.bytes) found = std::move(exact);
    }
    if (!found) found = finished();
    if (goal_.bytes) return;
    const double most =
        found ? std::max(kExactFactor * double(found->bytes), double(found->bytes + kExactBytes))
              : HUGE_VAL;
    if (found && (!exact_ || double(*exact_) > margin * most)) return;
    auto exact = unlessCancelled([&] { return std::optional(exactVoxels(job_)); });
    if (exact && double(exact->bytes) <= most) found = std::move(exact);
  });
  if (!found && goal_.psnr) throw Cancelled();
  if (found && goal_.bytes && found->bytes > *goal_.bytes) found.reset();
  if (found) found->seconds = seconds_;
  return found;
}

}  // namespace esvr::encode
