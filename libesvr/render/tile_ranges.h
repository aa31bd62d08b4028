#pragma once
/// For each tile of a picture, the range of samples in which its rays may meet bricks of cells.

#include <vector>

#include "render/brick_cover.h"

namespace esvr {

struct TileSamples {
  int first, last;  ///< counted from CoverView::firstSample; none if last < first
};

class TileRanges {
 public:
  static constexpr int kSide = 8;  ///< pixels

  /// The rays meet no bricks.
  explicit TileRanges(Resolution resolution);
  /// Widens the ranges by those of further bricks.
  /// \param view    has the resolution of all other views; its first sample is the same too
  /// \param bricks  places in bricks, in the frame of the view
  void add(const CoverView& view, const std::vector<Coord>& bricks);

  [[nodiscard]] int columns() const { return columns_; }
  [[nodiscard]] int rows() const { return rows_; }
  [[nodiscard]] const TileSamples& at(int column, int row) const {
    return ranges_[std::size_t(row) * std::size_t(columns_) + std::size_t(column)];
  }

 private:
  void addOne(const CoverView& view, const Coord& brick);

  int columns_, rows_;
  std::vector<TileSamples> ranges_;
};

}  // namespace esvr
