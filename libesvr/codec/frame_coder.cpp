#include "codec/frame_coder.h"

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
        thrift_(thrift) {}

  void brick(Side& side, std::size_t b) {
    codeMotion(side, b);
    past_.fill(layer_.bricks[b], motion_, cube_);
    if (codeCopy(side, b)) return;
    halo_.fill(layer_, index_, b, vacantCode_);
    fillErrors(b);
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
      wanted = search_.find(layer_.bricks[b], {&layer_.codes[b * kBrickVoxels], kBrickVoxels},
                            motion_);
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

  void voxel(Side& side, std::size_t b, int v) {
    const Coord local = voxelLocal(v);
    const auto cell = std::size_t(Halo::cell(local));
    at_ = b * kBrickVoxels + std::size_t(v);
    predictor_.look(&halo_.code[cell], &cube_.place[Cube::cell(local)], &error_[cell]);
    std::int32_t& code = layer_.codes[at_];
    const bool active = codeActive(side, cell, Cube::cell(local), layer_.active[b].test(v));
    if (active) layer_.active[b].set(v);
    const bool vacant =
        !active && side.bit(vacant_[lastVacant_], layer_.vacant[b].test(v));
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
    const auto beyond = std::uint64_t(std::abs(difference)) - 1;
    const std::uint64_t more = beyond_[context].code(side, beyond);
    if (more > kMaxDifference) throw BadInput("a voxel is further off than can be");
    const auto magnitude = std::int64_t(more) + 1;
    return negative ? -magnitude : magnitude;
  }

  /// The code with the least cost among the nearest one and those towards the prediction.
  std::int32_t thriftyCode(std::int32_t nearest) {
    std::int32_t best = nearest;
    const std::int64_t guess = predictor_.guess();
    if (guess == nearest && thrift_->steadiness <= 0.0) return nearest;
    double least = costOf(nearest);
    for (std::int32_t code = nearest - kMaxSteps; code <= nearest + kMaxSteps; ++code) {
      if (code == nearest) continue;
      const double cost = costOf(code);
      if (cost < least) least = cost, best = code;
    }
    return best;
  }

  double costOf(std::int32_t code) {
    const double error = thrift_->exact[at_] - double(code);
    const double change = predictor_.past() - double(code);
    BitMeter meter;
    (void)codeDifference(meter, std::int64_t(code) - predictor_.guess());
    return error * error + thrift_->bitPrice * meter.bits +
           thrift_->steadiness * std::min(change * change, 1.0);
  }

  static constexpr int kMaxSteps = 1;
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
  std::size_t at_ = 0;  ///< index of the voxel in the layer's codes
  bool lastMoved_ = false, lastCopy_ = false, lastVacant_ = true;
  std::array<BitModel, 2> moved_, copy_, vacant_;
  std::array<TreeModel<kMotionBits>, 3> motions_;
  std::array<std::array<std::array<BitModel, 2>, 4>, FramePredictor::kDistances> active_;
  std::array<std::array<BitModel, FramePredictor::kParts>, FramePredictor::kContexts> differs_,
      sign_;
  std::array<NumberModelOf<6>, FramePredictor::kContexts> beyond_;
};

template <class Side>
void code(Side& side, std::span<const std::size_t> order, const PastVoxels& past,
          VoxelLayer& layer) {
  const auto coder = std::make_unique<FrameCoder<Side>>(past, layer);
  for (const std::size_t b : order) coder->brick(side, b);
}

}  // namespace

void chooseFrameCodes(std::span<const std::size_t> order, const PastVoxels& past,
                      const FrameThrift& thrift, VoxelLayer& layer) {
  Writer writer;
  const auto coder = std::make_unique<FrameCoder<Writer>>(past, layer, &thrift);
  for (const std::size_t b : order) coder->brick(writer, b);
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
