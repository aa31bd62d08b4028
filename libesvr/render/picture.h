#pragma once
/// The checked options of a picture, and its pixels while it is drawn. All CPU renderers use it.

#include "esvr/render.h"
#include "render/sample_rule.h"
#include "render/view.h"

namespace esvr {

/// \throws UsageError  as for renderField
void checkRenderOptions(const RenderOptions& options);

class Picture {
 public:
  /// \throws UsageError  as for renderField
  explicit Picture(const RenderOptions& options);

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
