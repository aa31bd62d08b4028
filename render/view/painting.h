#pragma once
/// A picture of a scene while it is drawn, and as a JPEG file.

#include <memory>
#include <optional>
#include <string>

#include "esvr/image.h"
#include "esvr/image_metrics.h"
#include "esvr/render.h"
#include "esvr/transfer_function.h"
#include "render/view/collection.h"
#include "render/view/requests.h"

namespace esvr::view {

/// The options of a scene's picture.
/// \throws BadInput  the collection has no such grid
[[nodiscard]] RenderOptions renderOptionsOf(const Collection& collection, const SceneWish& scene,
                                            Resolution size);

/// The picture of a grid and its reference that a comparison asks for. Differences are those of
/// each channel in front of black, and opaque.
/// \param image, reference  of the same size
[[nodiscard]] Image comparisonPicture(const Image& image, const Image& reference,
                                      const Comparison& comparison);

/// Draws a scene in passes from coarse to fine (esvr/render.h), with its reference if it has
/// one.
class Painting {
 public:
  struct Input {
    const Collection& collection;
    Drawables& drawables;
    const SceneWish& scene;
    Resolution size;
    const CancelToken* cancel;  ///< ends passes with Cancelled
  };
  /// \throws BadInput, UsageError, MemoryExceeded, DeviceError  the scene cannot be drawn
  explicit Painting(const Input& input);

  /// Draws the next pass, and further ones that are expected to end within the budget.
  /// \throws Cancelled, DeviceError
  void refine(double seconds);

  /// Draws the picture itself instead of further passes.
  /// \throws Cancelled, DeviceError
  void complete();
  [[nodiscard]] bool isComplete() const;
  /// The picture after the last pass. There must be one.
  [[nodiscard]] Image picture() const;
  /// Errors against the reference, of a complete picture.
  [[nodiscard]] std::optional<ImageMetrics> errors() const;
  /// Memory of the device that both renderers hold.
  [[nodiscard]] std::uint64_t deviceBytes() const;

 private:
  /// The picture of one grid. If nothing is active in it, the picture is transparent.
  struct Part {
    Part(const Input& input, const GridPlace& place, RenderOptions options);
    void refine(double seconds);
    void complete();
    [[nodiscard]] bool isComplete() const { return whole || passes->complete(); }
    [[nodiscard]] const Image& image() const { return whole ? *whole : *passes->image(); }

    std::shared_ptr<Drawable> drawable;
    Renderer* renderer = nullptr;
    RenderOptions options;
    std::optional<ProgressivePicture> passes;
    std::optional<Image> whole;  ///< a picture that was not drawn in passes
  };
  std::optional<Comparison> comparison_;
  Part own_;
  std::optional<Part> reference_;
};

// ---- JPEG files

struct JpegForm {
  Rgb background;         ///< color behind the picture
  double quality = 0.85;  ///< 0 to 1
};

/// Encodes a picture in sRGB, with colors at full resolution.
/// \throws RuntimeFailure  with the message of libjpeg
[[nodiscard]] std::string encodeJpeg(const Image& image, const JpegForm& form);

}  // namespace esvr::view
