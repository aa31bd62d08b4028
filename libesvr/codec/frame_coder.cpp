// The voxels of the previous frame on the lattice of the next one, the search for the motion of a brick, and the coder of frames: the bricks in the context of those of the previous frame, the prediction of a voxel from both
// frames, and the decisions for one voxel after the other.
//
// Predictions are computed in float64, and every machine must get the same bits: this file is compiled without
// contraction to fused operations.

#include "codec/frame_coder.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <memory>
#include <type_traits>

#include "codec/brick_coder.h"
#include "codec/voxel_coder.h"
#include "core/geometry.h"
#include "core/parallel.h"
#include "esvr/error.h"

namespace esvr::codec {
namespace {

/// Largest distance of two origins along an axis, in bricks.
constexpr std::int64_t kLargestShift = 1 << 24;

bool sameLattice(const VoxelLayer& a, const VoxelLayer& b) {
  return a.form == b.form && a.divisor == b.divisor && a.palette == b.palette;
}

/// Largest place of a value that a lattice has no code for. A code is at most 2^36 from it.
constexpr double kLargestPlace = 0x1p35;
constexpr double kLargestFloat = std::numeric_limits<float>::max();

double placeOf(const VoxelLayer& now, double value) {
  if (now.form == VoxelForm::kQuantised)
    return std::clamp(value * now.divisor, -kLargestPlace, kLargestPlace);
  return double(codeOfValue(now, float(std::clamp(value, -kLargestFloat, kLargestFloat))));
}

bool isNear(std::int32_t a, std::int32_t b) {
  return std::abs(std::int64_t(a) - b) <= kLargestShift * kBrickSide;
}

Coord shiftOf(const VoxelLayer& past, const VoxelLayer& now) {
  return brickOf(past.origin - now.origin);
}

}  // namespace

bool isPredictable(const VoxelLayer& now, const VoxelLayer& past) {
  if (!isNear(now.origin.x, past.origin.x) || !isNear(now.origin.y, past.origin.y) ||
      !isNear(now.origin.z, past.origin.z))
    return false;
  const std::int32_t vacant = codeOfValue(now, now.background);
  for (std::size_t i = 0; i < now.codes.size(); ++i)
    if (now.codes[i] != vacant && now.vacant[i / kBrickVoxels].test(int(i % kBrickVoxels)))
      return false;
  return true;
}

PastVoxels::PastVoxels(const VoxelLayer& past, const VoxelLayer& now, const ValueMap& map)
    : past_(past),
      index_(past.bricks),
      shift_(shiftOf(past, now)),
      vacantPlace_(double(codeOfValue(now, now.background))),
      places_(past.codes.size(), past.codes.get_allocator()) {
  const bool same = map == ValueMap{} && sameLattice(past, now);
  parallelFor(std::size_t{0}, past.bricks.size(), [&](std::size_t b) {
    for (std::size_t v = 0; v < kBrickVoxels; ++v) {
      const std::size_t i = b * kBrickVoxels + v;
      if (past.vacant[b].test(int(v)))
        places_[i] = vacantPlace_;
      else
        places_[i] =
            same ? double(past.codes[i])
                 : placeOf(now, map.gain * double(valueOfCode(past, past.codes[i])) + map.offset);
    }
  });
}

void PastVoxels::fillLine(Coord voxel, int count, double* place, bool* active) const {
  for (int done = 0; done < count;) {
    const int z = localOf(voxel).z, now = std::min(count - done, kBrickSide - z);
    const std::uint32_t b = find(brickOf(voxel));
    const int first = voxelOffset(localOf(voxel));
    for (int n = 0; n < now; ++n) {
      const bool there = b != BrickIndex::kNone;
      place[done + n] =
          there ? places_[std::size_t(b) * kBrickVoxels + std::size_t(first + n)] : vacantPlace_;
      active[done + n] = there && past_.active[b].test(first + n);
    }
    done += now;
    voxel.z += now;
  }
}

// ---- Motion

namespace {

/// Sum of distances, in codes, that coding another motion than the expected one is worth.
constexpr double kMotionPrice = 12.0;

bool isPossible(Coord motion) {
  return std::max({std::abs(motion.x), std::abs(motion.y), std::abs(motion.z)}) <= kLargestMotion;
}

constexpr Coord kSteps[] = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};

}  // namespace

Coord MotionSearch::find(Coord brick, std::span<const std::int32_t> codes, Coord expected) {
  past_.fill(brick, {}, *cube_);
  Coord best = expected;
  double least = costOf(best, codes, expected);
  const auto consider = [&](Coord motion) {
    if (!isPossible(motion)) return false;
    const double cost = costOf(motion, codes, expected);
    if (cost >= least) return false;
    least = cost, best = motion;
    return true;
  };
  consider({});
  for (bool better = least > 0.0; better;) {
    better = false;
    const Coord from = best;
    for (const Coord step : kSteps) better = consider(from + step) || better;
  }
  return best;
}

double MotionSearch::costOf(Coord motion, std::span<const std::int32_t> codes,
                            Coord expected) const {
  using Cube = PastCube<kLargestMotion>;
  double sum = motion == expected ? 0.0 : kMotionPrice;
  const std::int32_t* code = codes.data();
  for (int x = 0; x < kBrickSide; ++x)
    for (int y = 0; y < kBrickSide; ++y) {
      const double* place = &cube_->place[Cube::cell(Coord{x, y, 0} - motion)];
      for (int z = 0; z < kBrickSide; ++z) sum += std::abs(double(*code++) - place[z]);
    }
  return sum;
}

// ---- The coder

// ---- The bricks of a frame

namespace {

/// The active voxels of a brick's face. \param upper  the face with the largest coordinates
int activeOnFace(const BrickMask& mask, std::size_t axis, bool upper) {
  int count = 0;
  for (int v = 0; v < kBrickVoxels; ++v)
    count += voxelLocal(v).*kAxes[axis] == (upper ? kBrickSide - 1 : 0) && mask.test(v);
  return count;
}

/// The bricks of the previous frame as context, by the numbers of their active voxels.
class PastBricks {
 public:
  static constexpr std::size_t kKeptContexts = 11;  ///< widths of a number of voxels up to 512
  static constexpr std::size_t kAddedContexts = 8;  ///< widths of a number of voxels up to 64

  explicit PastBricks(const PastVoxels& past) : past_(past) {}

  [[nodiscard]] std::size_t count() const { return past_.layer().bricks.size(); }
  [[nodiscard]] Coord brickAt(std::size_t b) const { return past_.brickAt(b); }
  [[nodiscard]] std::uint32_t find(Coord brick) const { return past_.find(brick); }

  [[nodiscard]] std::size_t keptContext(std::size_t b) const {
    return std::size_t(std::bit_width(unsigned(past_.layer().active[b].count())));
  }

  /// The width of the largest number of active voxels of the previous frame on a face that a brick
  /// touches.
  [[nodiscard]] std::size_t addedContext(Coord brick) const {
    int most = 0;
    for (std::size_t a = 0; a < 3; ++a)
      for (const int step : {-1, 1}) {
        Coord other = brick;
        other.*kAxes[a] += step;
        const std::uint32_t b = past_.find(other);
        if (b != BrickIndex::kNone)
          most = std::max(most, activeOnFace(past_.layer().active[b], a, step < 0));
      }
    return std::size_t(std::bit_width(unsigned(most)));
  }

 private:
  const PastVoxels& past_;
};

}  // namespace

void codeFrameBricks(Writer& side, const PastVoxels& past, std::vector<Coord>& bricks) {
  const PastBricks set(past);
  bricks = BrickCoder<Writer, PastBricks>(side, set, bricks).code(bricks.size());
}

void codeFrameBricks(Reader& side, const PastVoxels& past, std::uint64_t maxNew,
                     std::vector<Coord>& bricks) {
  const PastBricks set(past);
  bricks = BrickCoder<Reader, PastBricks>(side, set, {}).code(maxNew);
}

// ---- The prediction of a voxel

namespace {

/// Predicts the code of a voxel from the voxels before it and from the previous frame around it.
class FramePredictor {
 public:
  /// Numbers of contexts. The last context is that of a guess that equals the vacant code.
  static constexpr std::size_t kContexts = 16, kParts = 5, kDistances = 12;
  static constexpr int kFractionBits = 4;  ///< predictions are rounded to 1/16 of a code

  /// Computes the prediction of a voxel.
  /// \param now     the voxel in the codes of a halo
  /// \param past    the voxel in the places of a cube of the previous frame
  /// \param errors  the voxel in the results of learn(), in the cells of a halo
  void look(const std::int32_t* now, const double* past, const std::uint8_t* errors) {
    past_ = *past;
    low_ = high_ = past_;
    std::size_t n = 0;
    for (const int back : kBefore) add(n, double(now[-back]));
    for (const int step : kAround) add(n, past[step]);
    const double guess = std::clamp(past_ + sums_.predict(terms_), low_, high_);
    fixed_ = std::int64_t(std::floor(std::clamp(guess, -0x1p40, 0x1p40) * kOne + 0.5));
    guess_ = (fixed_ + kOne / 2) >> kFractionBits;
    std::int64_t late = 0;
    for (std::size_t k = 0; k < 6; ++k) late += (k < 3 ? 2 : 1) * std::int64_t(errors[-kBefore[k]]);
    double change = 0.0;
    for (std::size_t k = 0; k < 3; ++k) change += std::abs(terms_[k] - terms_[7 + k]);
    expected_ = std::uint64_t(late) + std::uint64_t(std::min(change, 0x1p40) * 8.0) +
                std::uint64_t(std::min(high_ - low_, 0x1p40) * 4.0);
  }

  [[nodiscard]] std::int64_t guess() const { return guess_; }

  /// The context of the difference from the guess: the octave of the errors and changes around.
  [[nodiscard]] std::size_t context(std::int32_t vacantCode) const {
    if (guess_ == vacantCode) return kContexts - 1;
    return std::min(std::size_t(std::bit_width(expected_)), kContexts - 2);
  }

  /// The part of a code by which the guess was rounded, from 0 (up) to kParts - 1 (down).
  [[nodiscard]] std::size_t part() const {
    const std::int64_t rest = fixed_ - guess_ * kOne;  // from -8 to 7
    return std::size_t((rest + kOne / 2) * std::int64_t(kParts) / kOne);
  }

  /// The distance of the prediction from a code, in steps that grow.
  [[nodiscard]] std::size_t distanceFrom(std::int32_t code) const {
    const auto far = std::uint64_t(std::abs(fixed_ - std::int64_t(code) * kOne));
    if (far < 16) return std::size_t(far / 2);
    return std::min<std::size_t>(8 + std::size_t(std::bit_width(far / 32)), kDistances - 1);
  }

  /// \return the error of the prediction in 1/16 of a code, at most 255
  std::uint8_t learn(std::int32_t code) {
    if (low_ != high_ || double(code) != low_) sums_.learn(terms_, double(code) - past_);
    return std::uint8_t(std::min<std::int64_t>(std::abs(fixed_ - code * std::int64_t(kOne)), 255));
  }

  void solve() { sums_.solve(); }
  void fade() { sums_.fade(); }

 private:
  static constexpr int kOne = 1 << kFractionBits;
  static constexpr std::size_t kTerms = 18;
  using Cube = PastCube<1>;
  static constexpr std::array kBefore{Halo::kStepX,
                                      Halo::kStepY,
                                      Halo::kStepZ,
                                      Halo::kStepX + Halo::kStepY,
                                      Halo::kStepX + Halo::kStepZ,
                                      Halo::kStepY + Halo::kStepZ,
                                      Halo::kStepX + Halo::kStepY + Halo::kStepZ};
  static constexpr std::array kAround{-Cube::kStepX,
                                      -Cube::kStepY,
                                      -Cube::kStepZ,
                                      -Cube::kStepX - Cube::kStepY,
                                      -Cube::kStepX - Cube::kStepZ,
                                      -Cube::kStepY - Cube::kStepZ,
                                      -Cube::kStepX - Cube::kStepY - Cube::kStepZ,
                                      Cube::kStepX,
                                      Cube::kStepY,
                                      Cube::kStepZ,
                                      Cube::kStepX + Cube::kStepY + Cube::kStepZ};
  /// A third of the change of the voxels before it along the axes.
  static constexpr std::array<double, kTerms> kFirstWeights{
      0.33, 0.33, 0.33, 0, 0, 0, 0, -0.33, -0.33, -0.33, 0, 0, 0, 0, 0, 0, 0, 0};

  void add(std::size_t& n, double value) {
    low_ = std::min(low_, value);
    high_ = std::max(high_, value);
    terms_[n++] = value - past_;
  }

  LeastSquares<kTerms> sums_{kFirstWeights};
  std::array<double, kTerms> terms_{};
  double past_ = 0.0, low_ = 0.0, high_ = 0.0;
  std::int64_t fixed_ = 0, guess_ = 0;
  std::uint64_t expected_ = 0;
};

// ---- The voxels of a frame

constexpr int kMotionBits = 4;
constexpr std::uint32_t kMotionZero = kLargestMotion;

// What is expected of a frame before its first voxel, so that the frames of small volumes need not
// learn it (docs/lab-notes.md, "Frames of a sequence").
/// Share of differences of 0 by context, in 1/256.
constexpr std::array<std::uint8_t, FramePredictor::kContexts> kEqualShares{
    252, 252, 252, 252, 250, 232, 224, 200, 125, 64, 38, 26, 26, 26, 26, 128};
/// Share of positive differences by the part of the guess, in 1/256.
constexpr std::array<std::uint8_t, FramePredictor::kParts> kPositiveShares{32, 56, 128, 200, 224};
constexpr std::uint32_t kExpectations = 3;  // number of decisions that a share counts as

template <class Side>
class FrameCoder {
 public:
  /// \param thrift  if not null, codes are chosen; otherwise the layer's are coded
  FrameCoder(const PastVoxels& past, VoxelLayer& layer, const FrameThrift* thrift = nullptr)
      : past_(past),
        layer_(layer),
        index_(layer.bricks),
        search_(past),
        errors_(layer.codes.size()),
        vacantCode_(codeOfValue(layer, layer.background)),
        thrift_(thrift) {
    for (std::size_t context = 0; context < FramePredictor::kContexts; ++context)
      for (std::size_t part = 0; part < FramePredictor::kParts; ++part) {
        differs_[context][part] = BitModel(kEqualShares[context], kExpectations);
        sign_[context][part] = BitModel(kPositiveShares[part], kExpectations);
      }
  }

  void brick(Side& side, std::size_t b) {
    codeMotion(side, b);
    past_.fill(layer_.bricks[b], motion_, cube_);
    if (codeCopy(side, b)) return;
    fillBefore(b);
    if (thrift_) setTargets(b);
    for (int v = 0; v < kBrickVoxels; ++v) {
      if (v % kVoxelsPerSolution == 0) predictor_.solve();
      voxel(side, b, v);
    }
    predictor_.fade();
  }

 private:
  static constexpr bool kReads = std::is_same_v<Side, Reader>;
  static constexpr int kVoxelsPerSolution = 128;
  using Cube = PastCube<1>;

  void codeMotion(Side& side, std::size_t b) {
    Coord wanted = motion_;
    if constexpr (!kReads)
      wanted =
          search_.find(layer_.bricks[b], {&layer_.codes[b * kBrickVoxels], kBrickVoxels}, motion_);
    lastMoved_ = side.bit(moved_[lastMoved_], wanted != motion_);
    if (!lastMoved_) return;
    const auto component = [&](std::size_t axis, std::int32_t value) {
      const std::uint32_t n = motions_[axis].code(side, std::uint32_t(value) + kMotionZero);
      if (n > 2 * kMotionZero) throw BadInput("a motion is larger than can be");
      return std::int32_t(n) - std::int32_t(kMotionZero);
    };
    motion_.x = component(0, wanted.x);
    motion_.y = component(1, wanted.y);
    motion_.z = component(2, wanted.z);
  }

  /// Codes whether a brick equals the previous frame at its motion.
  bool codeCopy(Side& side, std::size_t b) {
    lastCopy_ = side.bit(copy_[lastCopy_], !kReads && !thrift_ && equalsPast(b));
    if (lastCopy_ && kReads) copyPast(b);
    return lastCopy_;
  }

  [[nodiscard]] bool equalsPast(std::size_t b) const {
    for (int v = 0; v < kBrickVoxels; ++v) {
      const std::size_t cell = Cube::cell(voxelLocal(v));
      const bool active = cube_.active[cell];
      if (layer_.active[b].test(v) != active || layer_.vacant[b].test(v) == active ||
          double(layer_.codes[b * kBrickVoxels + std::size_t(v)]) != cube_.place[cell])
        return false;
    }
    return true;
  }

  void copyPast(std::size_t b) {
    for (int v = 0; v < kBrickVoxels; ++v) {
      const std::size_t cell = Cube::cell(voxelLocal(v));
      const double place = cube_.place[cell];
      const auto code = std::int32_t(std::clamp(place, -0x1p31, 0x1p31 - 1.0));
      if (double(code) != place) throw BadInput("a copy of a frame with another lattice");
      layer_.codes[b * kBrickVoxels + std::size_t(v)] = code;
      (cube_.active[cell] ? layer_.active : layer_.vacant)[b].set(v);
    }
  }

  /// Sets what is known of the voxels before brick b.
  void fillBefore(std::size_t b) {
    const Halo::Before before = Halo::bricksBefore(layer_, index_, b);
    halo_.fillCodes(layer_, before, vacantCode_);
    Halo::forEachLine(before, [&](std::size_t cell, std::uint32_t neighbour, int v, int count) {
      const bool there = neighbour != BrickIndex::kNone;
      for (int n = 0; n < count; ++n, ++cell, ++v) {
        isActive_[cell] = there && layer_.active[neighbour].test(v);
        error_[cell] = there ? errors_[neighbour * std::size_t(kBrickVoxels) + std::size_t(v)] : 0;
      }
    });
  }

  /// Sets the values that chosen codes are to be near: the exact ones, with a share of the errors of
  /// the previous frame.
  void setTargets(std::size_t b) {
    // How far the values of the previous frame are from the exact values.
    std::array<double, kBrickVoxels> apart;
    const double* exact = &thrift_->exact[b * kBrickVoxels];
    for (int v = 0; v < kBrickVoxels; ++v)
      apart[std::size_t(v)] = cube_.place[Cube::cell(voxelLocal(v))] - exact[v];
    for (int v = 0; v < kBrickVoxels; ++v)
      target_[std::size_t(v)] = exact[v] + thrift_->steadiness * pastError(apart, voxelLocal(v));
  }

  /// Estimates the error of a voxel of the previous frame. The previous frame is apart from the
  /// frame by its error and by the change between the frames. The change is about the same for
  /// neighbours, and the errors are independent. \return 0 if the change is too large to tell
  static double pastError(const std::array<double, kBrickVoxels>& apart, Coord local) {
    double sum = 0.0;
    int count = 0;
    for (int x = std::max(local.x - 1, 0); x <= std::min(local.x + 1, kBrickSide - 1); ++x)
      for (int y = std::max(local.y - 1, 0); y <= std::min(local.y + 1, kBrickSide - 1); ++y)
        for (int z = std::max(local.z - 1, 0); z <= std::min(local.z + 1, kBrickSide - 1); ++z) {
          sum += apart[std::size_t(voxelOffset({x, y, z}))];
          ++count;
        }
    const double error = apart[std::size_t(voxelOffset(local))] - sum / count;
    return std::abs(error) < kLargestError ? error : 0.0;
  }

  void voxel(Side& side, std::size_t b, int v) {
    const Coord local = voxelLocal(v);
    const auto cell = std::size_t(Halo::cell(local));
    at_ = b * kBrickVoxels + std::size_t(v);
    predictor_.look(&halo_.code[cell], &cube_.place[Cube::cell(local)], &error_[cell]);
    std::int32_t& code = layer_.codes[at_];
    const bool active = codeActive(side, cell, Cube::cell(local), layer_.active[b].test(v));
    if (active) layer_.active[b].set(v);
    const bool vacant = !active && side.bit(vacant_[lastVacant_], layer_.vacant[b].test(v));
    if (!active) lastVacant_ = vacant;
    if (vacant) layer_.vacant[b].set(v);
    code = vacant ? vacantCode_ : codeDistance(side, code);
    halo_.code[cell] = code;
    isActive_[cell] = active;
    error_[cell] = errors_[at_] = predictor_.learn(code);
  }

  bool codeActive(Side& side, std::size_t cell, std::size_t pastCell, bool active) {
    const std::size_t around = std::size_t(isActive_[cell - Halo::kStepX]) +
                               std::size_t(isActive_[cell - Halo::kStepY]) +
                               std::size_t(isActive_[cell - Halo::kStepZ]);
    const std::size_t far = predictor_.distanceFrom(vacantCode_);
    return side.bit(active_[far][around][cube_.active[pastCell]], active);
  }

  std::int32_t codeDistance(Side& side, std::int32_t written) {
    if (thrift_) written = thriftyCode(written);
    const std::int64_t guess = predictor_.guess();
    const std::int64_t difference = codeDifference(side, std::int64_t(written) - guess);
    const std::int64_t result = guess + difference;
    if (result != std::int32_t(result)) throw BadInput("a voxel does not fit 32 bits");
    return std::int32_t(result);
  }

  template <class AnySide>
  std::int64_t codeDifference(AnySide& side, std::int64_t difference) {
    const std::size_t context = predictor_.context(vacantCode_), part = predictor_.part();
    if (!side.bit(differs_[context][part], difference != 0)) return 0;
    const bool negative = side.bit(sign_[context][part], difference < 0);
    const std::uint64_t magnitude =
        codeMagnitude(side, context, std::uint64_t(std::abs(difference)));
    if (magnitude > kMaxDifference) throw BadInput("a voxel is further off than can be");
    return negative ? -std::int64_t(magnitude) : std::int64_t(magnitude);
  }

  /// Codes a number above 0: whether it is above 1, above 2, ..., and the rest.
  template <class AnySide>
  std::uint64_t codeMagnitude(AnySide& side, std::size_t context, std::uint64_t magnitude) {
    for (std::uint64_t n = 1; n <= kUnary; ++n)
      if (!side.bit(above_[context][n - 1], magnitude > n)) return n;
    return kUnary + 1 + rest_[context].code(side, magnitude - kUnary - 1);
  }

  /// The code with the least cost: the one nearest to the target, the next ones towards the
  /// prediction, or the prediction itself if it is near.
  std::int32_t thriftyCode(std::int32_t written) {
    if (thrift_->bitPrice <= 0.0) return written;
    const double target = target_[at_ % kBrickVoxels];
    if (std::abs(target) > kLargestTarget) return written;
    const bool keeps = thrift_->signs == RoundedSigns::kKept;
    const auto nearest = signedLike(written, std::int32_t(std::lround(target)), keeps);
    const std::int64_t guess = predictor_.guess();
    if (guess == nearest) return nearest;
    const std::int32_t step = guess > nearest ? 1 : -1;
    double least = costOf(target, nearest);
    std::int32_t best = nearest;
    for (int n = 1; n <= kMaxSteps && nearest + (n - 1) * step != guess; ++n) {
      const std::int32_t code = nearest + n * step;
      if (keeps && (code < 0) != (written < 0)) break;
      const double cost = costOf(target, code);
      if (cost < least) least = cost, best = code;
    }
    return best;
  }

  /// The code, or if its sign has to be kept and is another, the nearest code with the sign.
  static std::int32_t signedLike(std::int32_t written, std::int32_t code, bool keeps) {
    if (!keeps) return code;
    return written < 0 ? std::min(code, -1) : std::max(code, 0);
  }

  double costOf(double target, std::int32_t code) {
    const double error = target - double(code);
    BitMeter meter;
    (void)codeDifference(meter, std::int64_t(code) - predictor_.guess());
    return error * error + thrift_->bitPrice * meter.bits;
  }

  static constexpr double kLargestTarget = 0x1p30;
  static constexpr double kLargestError = 1.0;  // estimated errors above it are changes
  static constexpr int kMaxSteps = 2;
  static constexpr std::uint64_t kUnary = 3;  // flags of a magnitude before its rest
  static constexpr std::uint64_t kMaxDifference = std::uint64_t{1} << 36;

  const PastVoxels& past_;
  VoxelLayer& layer_;
  BrickIndex index_;
  MotionSearch search_;
  Coord motion_;
  Halo halo_{};
  Cube cube_{};
  FramePredictor predictor_;
  std::vector<std::uint8_t> errors_;                ///< by voxel
  std::array<std::uint8_t, Halo::kCells> error_{};  ///< those of the halo
  std::array<bool, Halo::kCells> isActive_{};       ///< activities of the halo
  std::int32_t vacantCode_;
  const FrameThrift* thrift_;
  std::array<double, kBrickVoxels> target_{};  ///< values that codes of the brick are to be near
  std::size_t at_ = 0;                         ///< index of the voxel in the layer's codes
  bool lastMoved_ = false, lastCopy_ = false, lastVacant_ = true;
  std::array<BitModel, 2> moved_, copy_, vacant_;
  std::array<TreeModel<kMotionBits>, 3> motions_;
  std::array<std::array<std::array<BitModel, 2>, 4>, FramePredictor::kDistances> active_;
  std::array<std::array<BitModel, FramePredictor::kParts>, FramePredictor::kContexts> differs_,
      sign_;
  std::array<std::array<BitModel, kUnary>, FramePredictor::kContexts> above_;
  std::array<NumberModelOf<6>, FramePredictor::kContexts> rest_;
};

template <class Side>
void codeBricks(Side& side, std::span<const std::size_t> order, const PastVoxels& past,
                VoxelLayer& layer, const FrameThrift* thrift = nullptr) {
  const auto coder = std::make_unique<FrameCoder<Side>>(past, layer, thrift);
  for (const std::size_t b : order) {
    throwIfCancelled();
    coder->brick(side, b);
  }
}

}  // namespace

void chooseFrameCodes(std::span<const std::size_t> order, const PastVoxels& past,
                      const FrameThrift& thrift, VoxelLayer& layer) {
  Writer writer;
  codeBricks(writer, order, past, layer, &thrift);
}

void codeFrameVoxels(Writer& side, std::span<const std::size_t> order, const PastVoxels& past,
                     VoxelLayer& layer) {
  codeBricks(side, order, past, layer);
}

void codeFrameVoxels(Reader& side, std::span<const std::size_t> order, const PastVoxels& past,
                     VoxelLayer& layer) {
  Reader local = side;
  codeBricks(local, order, past, layer);
  side = local;
}

}  // namespace esvr::codec
