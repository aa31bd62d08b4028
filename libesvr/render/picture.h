#pragma once
/// What the rays of a picture share, made from its checked options, and its pixels while it is
/// drawn.

#include <algorithm>
#include <utility>
#include <vector>

#include "esvr/render.h"
#include "render/brick_march.h"

namespace esvr {

/// \throws UsageError  as for renderField, or the options have not as many looks as there are grids
void checkRenderOptions(const RenderOptions& options, std::size_t grids = 1);
/// \throws UsageError  the options have a shading, which needs voxels in bricks
void refuseShading(const RenderOptions& options);
/// \throws Cancelled  RenderOptions::cancel was set
void checkCancelled(const RenderOptions& options);

/// The view of a volume. \param box  of its cells, in index space; low > high: there are none
[[nodiscard]] inline View viewOf(const RenderOptions& o, const PlaceBox& box) {
  return {o.camera, o.resolution, box, o.step};
}
/// What all rays of a picture share, in the index space of level 0 and without a box.
[[nodiscard]] MarchScene marchScene(const RenderOptions& options, const View& view,
                                    const SampleRule& rule);
/// The bins whose samples may lie in a box; empty if last < first.
[[nodiscard]] BinRange binsWithin(const PlaceBox& box, const View& view, double step);
/// \throws UsageError  a ray has more than kMostRaySamples samples in these bins
void checkRayLength(const BinRange& bins);
/// The samples that are drawn in each level of detail. \param box  all voxels lie in it
[[nodiscard]] LevelBounds levelBounds(const RenderOptions& options, const View& view,
                                      const PlaceBox& box);

class Picture {
 public:
  /// \param box  as for viewOf()
  /// \throws UsageError  as for renderField
  Picture(const RenderOptions& options, const PlaceBox& box, std::size_t grids = 1);

  const View view;
  const TransferTable table;

  void set(int column, int row, const PixelColor& color) {
    float* pixel =
        &image_.rgba[4 * (std::size_t(row) * std::size_t(image_.width) + std::size_t(column))];
    pixel[0] = color.r, pixel[1] = color.g, pixel[2] = color.b, pixel[3] = color.alpha;
  }
  [[nodiscard]] Image take() { return std::move(image_); }

 private:
  Image image_;
};

/// The tables of a transfer function for the levels of detail of a picture.
class LevelTables {
 public:
  /// \param picture  has the table of level 0; must outlive the object
  LevelTables(const Picture& picture, const RenderOptions& options, const LevelBounds& bounds)
      : picture_(picture), first_(std::max(1, bounds.first)) {
    for (int level = first_; level <= bounds.last; ++level)
      coarser_.emplace_back(options.transfer, samplingOf(options, LevelFrame{level}.side()));
  }

  /// \param level  from bounds.first to bounds.last
  [[nodiscard]] TransferTableView view(int level) const {
    return level == 0 ? picture_.table.view() : coarser_[std::size_t(level - first_)].view();
  }

 private:
  const Picture& picture_;
  int first_;
  std::vector<TransferTable> coarser_;
};

}  // namespace esvr
