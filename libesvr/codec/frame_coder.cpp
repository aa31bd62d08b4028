#include "codec/frame_coder.h"
#include "core/parallel.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <type_traits>

#include "codec/frame_predictor.h"
#include "codec/motion_search.h"
#include "codec/voxel_halo.h"
#include "codec/voxel_values.h"
#include "esvr/error.h"

namespace esvr::codec {
namespace {

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
    halo_.fill(layer_, index_, b, vacantCode_);
    fillErrors(b);
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

  void fillErrors(std::size_t b) {
    Halo::forEachBefore(layer_, index_, b, [&](std::size_t cell, std::uint32_t neighbour, int v) {
      const bool there = neighbour != BrickIndex::kNone;
      error_[cell] = there ? errors_[neighbour * std::size_t(kBrickVoxels) + std::size_t(v)] : 0;
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
    halo_.active[cell] = active;
    error_[cell] = errors_[at_] = predictor_.learn(code);
  }

  bool codeActive(Side& side, std::size_t cell, std::size_t pastCell, bool active) {
    const std::size_t around = std::size_t(halo_.active[cell - Halo::kStepX]) +
                               std::size_t(halo_.active[cell - Halo::kStepY]) +
                               std::size_t(halo_.active[cell - Halo::kStepZ]);
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
void code(Side& side, std::span<const std::size_t> order, const PastVoxels& past,
          VoxelLayer& layer) {
  const auto coder = std::make_unique<FrameCoder<Side>>(past, layer);
  for (const std::size_t b : order) {
    throwIfCancelled();
    coder->brick(side, b);
  }
}

}  // namespace

void chooseFrameCodes(std::span<const std::size_t> order, const PastVoxels& past,
                      const FrameThrift& thrift, VoxelLayer& layer) {
  Writer writer;
  const auto coder = std::make_unique<FrameCoder<Writer>>(past, layer, &thrift);
  for (const std::size_t b : order) {
    throwIfCancelled();
    coder->brick(writer, b);
  }
}

void codeFrameVoxels(Writer& side, std::span<const std::size_t> order, const PastVoxels& past,
                     VoxelLayer& layer) {
  code(side, order, past, layer);
}

void codeFrameVoxels(Reader& side, std::span<const std::size_t> order, const PastVoxels& past,
                     VoxelLayer& layer) {
  Reader local = side;
  code(local, order, past, layer);
  side = local;
}

}  // namespace esvr::codec
