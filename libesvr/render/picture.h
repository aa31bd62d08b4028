#pragma once
/// The checked options of a picture, and its pixels while it is drawn. All CPU renderers use it.

#include "esvr/render.h"
#include "render/march_scene.h"
#include "render/sample_rule.h"
#include "render/view.h"

namespace esvr {

/// \throws UsageError  as for renderField, or the options have not as many looks as there are grids
void checkRenderOptions(const RenderOptions& options, std::size_t grids = 1);
/// \throws UsageError  the options have a shading, which needs voxels in bricks
void refuseShading(const RenderOptions& options);

/// What all rays of a picture share, in the index space of level 0 and without a box.
[[nodiscard]] MarchScene marchScene(const RenderOptions& options, const View& view,
                                    const SampleRule& rule);

/// The view of a volume. \param box  of its cells, in index space; low > high: there are none
[[nodiscard]] inline View viewOf(const RenderOptions& o, const PlaceBox& box) {
  return {o.camera, o.resolution, box, o.step};
}

class Picture {
 public:
  /// \param box  as for viewOf()
  /// \throws UsageError  as for renderField
  Picture(const RenderOptions& options, const PlaceBox& box, std::size_t grids = 1);

  const View view;
  const TransferTable table;

  void set(int column, int row, const PixelColor& color);
  [[nodiscard]] Image take() { return std::move(image_); }

 private:
  Image image_;
};

/// \throws Cancelled  RenderOptions::cancel was set
void checkCancelled(const RenderOptions& options);

}  // namespace esvr
