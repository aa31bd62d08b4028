// Stores of bricks on a CUDA device: the bricks of a field with the ellipsoids that reach them,
// those of a volume with their voxels, and given bricks of a field that are decoded and copied
// back.
#include "render/cuda/cell_store.h"

#include <algorithm>
#include <array>
#include <iterator>
#include <numeric>
#include <optional>
#include <utility>

#include "core/brick_index.h"
#include "core/cuda/device_buffer.h"
#include "core/cuda/runtime.h"
#include "core/geometry.h"
#include "field/brick_pairs.h"
#include "field/coarser_field.h"
#include "field/evaluate.h"
#include "render/cuda/cuda_renderers.h"

namespace esvr::cuda {

// The bricks of a field and the ellipsoids that reach them.

namespace {

/// The cells of a brick have 9 voxels along an axis instead of 8. In a frame that is moved by half
/// a voxel, this is a support that is half a voxel wider.
Support reachOfCells(const Support& s) {
  constexpr double kHalf = 0.5;
  return makeSupport({s.center[0] - kHalf, s.center[1] - kHalf, s.center[2] - kHalf}, s.L, s.radius,
                     s.slack + kHalf);
}

/// Bit c is set if the brick of corner c is one of the given bricks.
std::uint8_t cornersIn(const BrickIndex& given, Coord brick) {
  unsigned bits = 0;
  for (int c = 0; c < kCellCorners; ++c)
    if (given.find(brick + stepToCorner(c)) != BrickIndex::kNone) bits |= 1u << c;
  return std::uint8_t(bits);
}

/// Numbers the bricks that supports reach.
void numberBricks(CellField& cells, std::vector<Coord> reached, const RevoxeliseOptions& voxels) {
  const BrickIndex given(bricksAt(voxels.bricks));
  if (voxels.restrictToBricks)
    std::erase_if(reached, [&](Coord brick) { return cornersIn(given, brick) == 0; });
  cells.table = makeBrickTable(std::move(reached));
  if (!voxels.restrictToBricks) return;
  for (std::size_t i = 0; i < cells.table.bricks.size(); ++i)
    cells.corners.push_back(cornersIn(given, cells.table.place(i)));
  // The masks of the voxels at the corners of the bricks.
  cells.masks.assign(voxels.masks.begin(), voxels.masks.end());
  if (cells.masks.empty()) return;
  for (std::size_t i = 0; i < cells.table.bricks.size(); ++i)
    for (int c = 0; c < kCellCorners; ++c)
      cells.maskOf.push_back(given.find(cells.table.place(i) + stepToCorner(c)));
}

}  // namespace

namespace {

/// Adds the ellipsoids that reach the bricks of the table, and the rule of their voxels.
void addEllipsoids(const Field& field, const RevoxeliseOptions& voxels, CellField& cells) {
  GatheredField gathered = gather(field);
  std::vector<Support> reach = supports(field);
  cells.forms.reserve(reach.size());
  for (std::size_t i = 0; i < reach.size(); ++i)
    cells.forms.push_back({gathered.forms[i], float(reach[i].half[2]), gathered.chunkOf[i]});
  std::ranges::transform(reach, reach.begin(), reachOfCells);
  BrickPairs pairs = pairsWithin(BrickIndex(placesOf(cells.table)), reach.size(),
                                 [&](std::size_t i) { return reach[i]; });
  cells.begin = std::move(pairs.brickBegin);
  cells.ellipsoid = std::move(pairs.ellipsoid);
  cells.kernels = std::move(gathered.kernels);
  cells.origins = std::move(gathered.origins);
  cells.box = voxels.box;
  cells.alwaysActive.assign(voxels.alwaysActive.begin(), voxels.alwaysActive.end());
  cells.rule = makeVoxelRule(field.background, voxels);
}

}  // namespace

CellField makeCellField(const Field& field, const RevoxeliseOptions& voxels) {
  CellField cells;
  std::vector<Support> reach = supports(field);
  std::ranges::transform(reach, reach.begin(), reachOfCells);
  requireListable(reach, bricksOf(Box::whole()));
  // The bricks of cells of which a corner may lie in the box.
  Box within = voxels.box;
  if (!within.empty()) {
    const Box bricks = bricksOf(voxels.box);
    within = {bricks.min - Coord{1, 1, 1}, bricks.max};
  }
  numberBricks(cells,
               missingBricks(
                   BrickIndex(std::span<const Coord>{}), reach.size(),
                   [&](std::size_t i) { return reach[i]; }, within),
               voxels);
  addEllipsoids(field, voxels, cells);
  cells.boxOfGrid = voxels.box;
  return cells;
}

CellField makeCoarserCellField(const Field& field, const RevoxeliseOptions& voxels, int level,
                               std::uint32_t firstBrick) {
  const Field coarser = coarserField(field, level);
  const RevoxeliseOptions rule = coarserRule(voxels, level);
  CellField cells;
  cells.table =
      makeBrickTable(bricksWithCells(bricksAt(coarserReach(coarser, rule.box))), firstBrick);
  addEllipsoids(coarser, rule, cells);
  cells.level = level;
  cells.boxOfGrid = voxels.box;
  return cells;
}

static_assert(CellFieldView::kNoMask == BrickIndex::kNone, "masks are numbered by brick");

DeviceSums::DeviceSums(const CellField& field, cudaStream_t stream)
    : rule_(field.rule),
      level_(field.level),
      box_(field.box),
      boxOfGrid_(field.boxOfGrid),
      forms_(field.forms, stream),
      kernels_(field.kernels, stream),
      origins_(field.origins, stream),
      begin_(field.begin, stream),
      ellipsoid_(field.ellipsoid, stream),
      corners_(field.corners, stream),
      masks_(field.masks, stream),
      maskOf_(field.maskOf, stream),
      alwaysActive_(field.alwaysActive, stream) {}

void DeviceSums::describe(CellFieldView& view) const {
  view.level = level_;
  view.forms = forms_.data();
  view.kernels = kernels_.data();
  view.kernelStride = kernels_.size() > 1 ? 1u : 0u;
  view.origins = origins_.data();
  view.begin = begin_.data();
  view.ellipsoid = ellipsoid_.data();
  view.corners = corners_.data();
  view.masks = masks_.data();
  view.maskOf = maskOf_.data();
  view.box = box_;
  view.alwaysActive = alwaysActive_.data();
  view.alwaysActiveCount = std::uint32_t(alwaysActive_.size());
  view.rule = rule_;
  view.boxOfGrid = boxOfGrid_;
}

std::size_t DeviceSums::bytes() const {
  return forms_.bytes() + kernels_.bytes() + origins_.bytes() + begin_.bytes() +
         ellipsoid_.bytes() + corners_.bytes() + masks_.bytes() + maskOf_.bytes() +
         alwaysActive_.bytes();
}

DeviceCells::DeviceCells(const CellField& field, cudaStream_t stream) { add(field, stream); }

void DeviceCells::add(const CellField& coarser, cudaStream_t stream) {
  levels_.emplace_back(coarser.table, stream);
  sums_.emplace_back(coarser, stream);
}

CellFieldView DeviceCells::view(int level) const {
  CellFieldView view{};
  view.table = levels_.front().table();
  for (int l = 0; l < levelCount(); ++l) {
    const DeviceLevel& of = levels_[std::size_t(l)];
    view.levels[l] = {of.table().origin, of.first(), of.count(), of.bricks()};
  }
  sums_[std::size_t(level) < sums_.size() ? std::size_t(level) : 0].describe(view);
  return view;
}

std::size_t DeviceCells::bytes() const {
  std::size_t bytes = 0;
  for (const DeviceSums& sums : sums_) bytes += sums.bytes();
  for (const DeviceLevel& level : levels_) bytes += level.bytes();
  return bytes;
}

// Stores.

namespace {

class FieldStore final : public CellStore {
 public:
  FieldStore(const Field& field, const RevoxeliseOptions& voxels, cudaStream_t stream)
      : FieldStore(field, voxels, makeCellField(field, voxels), stream) {}

  float background() const override { return cells_.background(); }
  /// Makes all levels at once, because the bricks of all are numbered together.
  void prepare(const LevelBounds& bounds) override {
    if (bounds.last == 0 || cells_.levelCount() == kLevels) return;
    if (hasCoarserFields(field_, voxels_))
      addSums();
    else
      addMeans();
    cache_.number();
  }
  const DeviceLevel& level(int level) const override { return cells_.level(level); }
  BrickSlotsView slots() const override { return cache_.slots(); }
  BrickCache* cache() override { return &cache_; }
  std::size_t bytes() const override { return cells_.bytes() + cache_.bytes(); }

 private:
  FieldStore(const Field& field, const RevoxeliseOptions& voxels, const CellField& cells,
             cudaStream_t stream)
      : field_(field),
        voxels_(voxels),
        places_(placesOf(cells.table)),
        stream_(stream),
        cells_(cells, stream),
        cache_(cells_, stream) {}

  void addSums() {
    while (cells_.levelCount() < kLevels)
      cells_.add(makeCoarserCellField(field_, voxels_, cells_.levelCount(), cells_.brickCount()),
                 stream_);
  }
  void addMeans() {
    std::vector<Coord> bricks = std::move(places_);
    while (cells_.levelCount() < kLevels) {
      bricks = coarserBricks(bricks);
      cells_.add(
          DeviceLevel(makeBrickTable(bricksWithCells(bricks), cells_.brickCount()), stream_));
    }
  }

  const Field& field_;
  const RevoxeliseOptions voxels_;
  std::vector<Coord> places_;  ///< bricks of level 0, until coarser levels are made
  cudaStream_t stream_;
  DeviceCells cells_;
  BrickCache cache_;
};

class VolumeStore final : public CellStore {
 public:
  VolumeStore(const SparseVolume& volume, cudaStream_t stream)
      : stream_(stream), background_(volume.background), levels_(volume) {
    makeLevel(0);
  }

  float background() const override { return background_; }
  void prepare(const LevelBounds& bounds) override {
    levels_.prepare(bounds.last);
    for (int level = bounds.first; level <= bounds.last; ++level)
      if (!made_[std::size_t(level)]) makeLevel(level);
  }
  const DeviceLevel& level(int level) const override { return made_[std::size_t(level)]->level; }
  BrickSlotsView slots() const override { return {nullptr, pageTable_.data()}; }
  std::size_t bytes() const override {
    std::size_t bytes = pageTable_.bytes();
    for (const auto& made : made_)
      if (made) bytes += made->level.bytes() + made->values.bytes();
    return bytes;
  }

 private:
  struct Made {
    DeviceLevel level;
    DeviceBuffer<float> values;  ///< of all bricks; brick n has slot n
  };

  void makeLevel(int level) {
    const BrickAtlas atlas =
        makeBrickAtlas(levels_[level], std::uint32_t(pages_.size() * BrickSlotsView::kPageSlots));
    constexpr std::size_t kSlots = BrickSlotsView::kPageSlots;
    const std::size_t pages = (atlas.table.bricks.size() + kSlots - 1) / kSlots;
    DeviceBuffer<float> values(pages * BrickSlotsView::kPageFloats, stream_);
    uploadTo(values.data(), std::span<const float>(atlas.values), stream_);
    for (std::size_t first = 0; first < values.size(); first += BrickSlotsView::kPageFloats)
      pages_.push_back(values.data() + first);
    pageTable_ = DeviceBuffer<const float*>(pages_, stream_);
    made_[std::size_t(level)].emplace(DeviceLevel(atlas.table, stream_), std::move(values));
  }

  cudaStream_t stream_;
  float background_;
  VolumeLevels levels_;
  std::array<std::optional<Made>, kLevels> made_;
  std::vector<const float*> pages_;
  DeviceBuffer<const float*> pageTable_;  ///< see BrickSlotsView
};

}  // namespace

std::unique_ptr<CellStore> storeOf(const Field& field, const RevoxeliseOptions& voxels,
                                   cudaStream_t stream) {
  return std::make_unique<FieldStore>(field, voxels, stream);
}

std::unique_ptr<CellStore> storeOf(const SparseVolume& volume, cudaStream_t stream) {
  return std::make_unique<VolumeStore>(volume, stream);
}

// Given bricks.

namespace {

constexpr std::uint32_t kBatch = BrickSlotsView::kPageSlots;  ///< bricks that are decoded at a time

/// A page of voxels on the device, into which batches of bricks are decoded.
class DecodeBatches {
 public:
  DecodeBatches(const DeviceCells& cells, cudaStream_t stream)
      : cells_(cells),
        stream_(stream),
        page_(BrickSlotsView::kPageFloats, stream),
        pageTable_(1, stream),
        numbers_(kBatch, stream),
        slots_(kBatch, stream),
        occupied_(kBatch, stream),
        values_(BrickSlotsView::kPageFloats) {
    float* const page = page_.data();
    uploadTo(pageTable_.data(), std::span<float* const>(&page, 1), stream);
    // Brick n of a batch gets slot n; the decoder counts down from the last slot.
    std::vector<std::uint32_t> slots(kBatch);
    std::iota(slots.rbegin(), slots.rend(), 0u);
    slots_.upload(slots);
  }

  /// Decodes bricks of the finest level. \return kCellBrickVoxels values for each brick
  const float* decode(std::span<const std::uint32_t> numbers) {
    uploadTo(numbers_.data(), numbers, stream_);
    occupied_.setZero();
    launchDecode({.field = cells_.view(0),
                  .bricks = numbers_.data(),
                  .count = std::uint32_t(numbers.size()),
                  .lastSlot = slots_.data() + kBatch - 1,
                  .pages = pageTable_.data(),
                  .occupied = occupied_.data()},
                 0, stream_);
    page_.download(values_);
    return values_.data();
  }

 private:
  const DeviceCells& cells_;
  cudaStream_t stream_;
  DeviceBuffer<float> page_;
  DeviceBuffer<float*> pageTable_;
  DeviceBuffer<std::uint32_t> numbers_, slots_;
  DeviceBuffer<std::uint8_t> occupied_;
  std::vector<float> values_;
};

}  // namespace

void decodeBricks(const Device& device, const Field& field, std::span<const Coord> corners,
                  std::span<float> out) {
  std::ranges::fill(out, field.background);
  const CellField cells = makeCellField(field, {.bricks = corners, .restrictToBricks = true});
  // The bricks that ellipsoids reach: their numbers in the table and their places in the list.
  const BrickIndex table(placesOf(cells.table));
  std::vector<std::uint32_t> numbers;
  std::vector<std::size_t> places;
  for (std::size_t b = 0; b < corners.size(); ++b) {
    const std::uint32_t number = table.find(brickOf(corners[b]));
    if (number == BrickIndex::kNone) continue;
    numbers.push_back(number);
    places.push_back(b);
  }
  if (numbers.empty()) return;
  const Stream stream = streamOn(device);
  const DeviceCells onDevice(cells, stream.get());
  DecodeBatches batches(onDevice, stream.get());
  for (std::size_t first = 0; first < numbers.size(); first += kBatch) {
    const std::size_t count = std::min<std::size_t>(kBatch, numbers.size() - first);
    const float* const values = batches.decode(std::span(numbers).subspan(first, count));
    // The voxels of the bricks without those of their upper neighbours.
    for (std::size_t n = 0; n < count; ++n)
      for (int x = 0; x < kBrickSide; ++x)
        for (int y = 0; y < kBrickSide; ++y)
          std::copy_n(values + n * kCellBrickVoxels + (x * kCellBrickSide + y) * kCellBrickSide,
                      kBrickSide,
                      &out[places[first + n] * std::size_t(kBrickVoxels) +
                           std::size_t(voxelOffset({x, y, 0}))]);
  }
}

}  // namespace esvr::cuda
