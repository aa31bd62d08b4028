#pragma once
/// Both renderers share this: checked options and the picture in the making.

#include "esvr/render.h"
#include "render/sample_rule.h"
#include "render/view.h"

namespace esvr {

/// \throws UsageError  as renderField
void checkRenderOptions(const RenderOptions& options);

class Picture {
 public:
  /// \throws UsageError  as renderField
  explicit Picture(const RenderOptions& options);

  const View view;
  const TransferTable table;

  void set(int column, int row, const PixelColor& color);
  [[nodiscard]] Image take() { return std::move(image_); }

 private:
  Image image_;
};

/// \throws Cancelled  where that was asked for
void checkCancelled(const RenderOptions& options);

}  // namespace esvr
