#pragma once
/// Pictures that are coarse at once and become finer, for programs that show them while a user waits.

#include <optional>

#include "esvr/renderer.h"

namespace esvr {

/// Draws one picture in passes. The sides of the first pass are an eighth of the picture's, those of
/// the next ones a quarter and a half, and the last pass is the picture itself, with the same bits as
/// Renderer::draw(). A coarse pass is enlarged by bilinear interpolation, so that every pass has the
/// size of the picture and shows the same view. With LevelOfDetail::kAuto, a coarse pass reads
/// coarser levels where its pixels are wide enough.
class ProgressivePicture {
 public:
  /// \param renderer  draws the passes; it must outlive the object and is used from the same thread
  /// \throws UsageError  as for Renderer::draw()
  ProgressivePicture(Renderer& renderer, RenderOptions options);

  /// Draws the next pass, and then further ones as long as they are expected to end within the
  /// budget. A pass is expected to take as long for each pixel as the one before. If it is cancelled
  /// or fails, the picture stays as it was after the last complete pass.
  /// \param seconds  the budget; 0 draws one pass
  /// \return whether the picture is complete
  /// \throws Cancelled, DeviceError  as for Renderer::draw()
  bool refine(double seconds);

  [[nodiscard]] bool complete() const { return side_ == 0; }
  /// The picture after the last pass; nothing before the first one.
  [[nodiscard]] const std::optional<Image>& image() const { return image_; }

 private:
  void drawPass();
  void show();

  Renderer& renderer_;
  RenderOptions options_;
  std::optional<Image> drawn_;  ///< the last pass before it is enlarged
  std::optional<Image> image_;
  int side_ = 8;  ///< pixels of the picture along the side of a pixel of the next pass; 0: complete
};

}  // namespace esvr
