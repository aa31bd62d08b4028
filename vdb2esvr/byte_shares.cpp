#include "vdb2esvr/byte_shares.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "esvr/error.h"
#include "esvr/grid_coding.h"

namespace esvr::vdb2esvr {
namespace {

std::optional<std::uint64_t> sizeOf(const Options& options, const VdbSummary& input) {
  if (options.size) return options.size;
  if (!options.ratio) return std::nullopt;
  return std::uint64_t(double(input.fileBytes) / *options.ratio);
}

/// The weight of a grid in the division, which is above 0 for empty grids.
double weightOf(const FittedGrid& grid) { return double(grid.source.activeVoxels) + 1.0; }

StoredGrid withDescriptor(StoredGrid grid, const GridDescriptor& descriptor) {
  grid.descriptor = descriptor;
  return grid;
}

/// The bytes that a twin usually adds: its record, and rows for the ellipsoids of one chunk, for
/// the bricks or the mask, and for the errors of layers. Voxels have fewer rows.
std::uint64_t usualBytes(const GridDescriptor& twin) {
  constexpr std::uint64_t kRows = 3;
  StoredGrid grid;
  grid.field.chunks.resize(1);
  return bytesAdded(withDescriptor(std::move(grid), twin)) + kRows * kSectionRowBytes;
}

/// The records of the grids of vectors.
std::uint64_t bytesOfVectorRecords(const std::vector<FittedGrid>& grids) {
  std::vector<StoredVector> vectors;
  for (std::size_t g = 0; g < grids.size(); ++g)
    if (grids[g].component == std::size_t{0}) vectors.push_back({grids[g].source.name, g});
  return bytesOfVectors(vectors);
}

/// What a file holds besides its fitted grids.
struct BesideFitted {
  const VdbSummary& input;
  const std::vector<FittedGrid>& grids;
  const std::vector<CarriedGrid>& carried;
};

/// \throws UsageError  the bytes leave nothing of `size`
std::uint64_t bytesOfAll(const BesideFitted& beside, std::uint64_t size) {
  const std::uint64_t ofCarried = bytesOfCarried(beside.carried);
  const std::uint64_t bytes =
      bytesBesideGrids(beside.input.metadata) + ofCarried + bytesOfVectorRecords(beside.grids);
  if (bytes < size) return bytes;
  std::string text = "the file takes " + std::to_string(bytes) + " bytes without any fitted grid";
  if (ofCarried > 0)
    text += " (grids that are carried unchanged take " + std::to_string(ofCarried) +
            " of them; --skip leaves them out)";
  throw UsageError(text + "; the size allows " + std::to_string(size));
}

/// Subtracts without passing 0.
std::uint64_t less(std::uint64_t bytes, std::uint64_t by) { return bytes - std::min(bytes, by); }

/// True for a frame of a sequence in which nothing is active, so that a size cannot make it smaller.
bool isEmptyFrame(const Options& options, const BesideFitted& file) {
  const auto isActive = [](const GridSummary& grid) { return grid.activeVoxels > 0; };
  return options.sequence && std::ranges::none_of(file.grids, isActive, &FittedGrid::source) &&
         std::ranges::none_of(file.carried, [&](const CarriedGrid& grid) {
           return isActive(file.input.grids.at(grid.place));
         });
}

}  // namespace

ByteShares::ByteShares(const Options& options, const VdbSummary& input,
                       const std::vector<FittedGrid>& grids, const Twins& twins,
                       const std::vector<CarriedGrid>& carried)
    : left_(sizeOf(options, input)), shares_(grids.size()) {
  // A file without grids has nothing to divide, and no option makes it smaller.
  if (input.grids.empty() || isEmptyFrame(options, {input, grids, carried})) left_.reset();
  if (!left_) return;
  *left_ -= bytesOfAll({input, grids, carried}, *left_);
  for (std::size_t g = 0; g < grids.size(); ++g) {
    if (const auto twin = twins.find(g); twin != twins.end())
      reserve(twin->second);
    else
      weightLeft_ += shares_[g].weight = weightOf(grids[g]), ++gridsLeft_;
  }
  // The record of a grid, its rows in the table, and the codes of a few values. Shares by active
  // voxels alone would be too small for a grid of a few voxels beside a large one.
  constexpr std::uint64_t kLeastOfGrid = 512;
  if (gridsLeft_ > 0) least_ = std::min(kLeastOfGrid, *left_ / gridsLeft_);
}

void ByteShares::reserve(const Twin& twin) {
  Share& share = shares_[twin.of];
  const std::uint64_t bytes = usualBytes(twin.descriptor);
  share.twins.push_back(twin.descriptor);
  share.reserved += bytes;
  left_ = less(*left_, bytes);
}

std::optional<std::uint64_t> ByteShares::of(std::size_t grid) const {
  if (!left_) return std::nullopt;
  const std::uint64_t divided = less(*left_, least_ * gridsLeft_);
  const std::uint64_t least = std::min(least_, *left_ / gridsLeft_);
  return least + std::uint64_t(double(divided) * shares_[grid].weight / weightLeft_);
}

std::uint64_t ByteShares::take(std::size_t grid, const StoredGrid& stored,
                               const StoredGrid* previous) {
  if (!left_) return 0;
  const Share& share = shares_[grid];
  const std::uint64_t bytes = bytesOf(share, stored, previous),
                      allowed = *of(grid) + share.reserved;
  if (bytes > allowed) return bytes - allowed;
  left_ = less(*left_ + share.reserved, bytes);
  weightLeft_ -= share.weight;
  --gridsLeft_;
  return 0;
}

std::uint64_t ByteShares::bytesOf(const Share& share, const StoredGrid& stored,
                                  const StoredGrid* previous) {
  const std::uint64_t bytes = bytesInFrame(stored, previous);
  if (share.twins.empty()) return bytes;
  std::vector<StoredGrid> all{stored};
  for (const auto& descriptor : share.twins) all.push_back(withDescriptor(stored, descriptor));
  return bytes + bytesAddedTogether(std::move(all)) - bytesAdded(stored);
}

}  // namespace esvr::vdb2esvr
