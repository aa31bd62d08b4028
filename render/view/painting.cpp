#include "render/view/painting.h"

#include <utility>

#include "render/render_options.h"
#include "render/view/comparison_picture.h"

namespace esvr::view {
namespace {

RenderOptions withCancel(RenderOptions options, const CancelToken* cancel) {
  options.cancel = cancel;
  return options;
}

/// The reference is drawn like the grid.
RenderOptions referenceOptions(const Painting::Input& input) {
  return withCancel(renderOptionsOf(input.collection, input.scene, input.size), input.cancel);
}

}  // namespace

RenderOptions renderOptionsOf(const Collection& collection, const SceneWish& scene,
                              Resolution size) {
  render::Options options = scene.options;
  options.resolution = size;
  return render::renderOptions(options, collection.gridAt(scene.place).outline);
}

Painting::Part::Part(const Input& input, const GridPlace& place, RenderOptions of)
    : drawable(input.drawables.get(place)), options(std::move(of)) {
  if (drawable) {
    renderer = &drawable->renderer(options.shading.has_value());
    passes.emplace(*renderer, options);
  } else {
    constexpr std::size_t kChannels = 4;
    whole = Image{input.size.width, input.size.height, {}};
    whole->rgba.resize(kChannels * std::size_t(whole->width) * std::size_t(whole->height));
  }
}

void Painting::Part::refine(double seconds) {
  if (passes) passes->refine(seconds);
}

void Painting::Part::complete() {
  if (!isComplete()) whole = renderer->draw(options);
}

Painting::Painting(const Input& input)
    : comparison_(input.scene.compare),
      own_(input, input.scene.place,
           withCancel(renderOptionsOf(input.collection, input.scene, input.size), input.cancel)) {
  if (comparison_) reference_.emplace(input, comparison_->with, referenceOptions(input));
}

void Painting::refine(double seconds) {
  const double share = reference_ ? seconds / 2.0 : seconds;
  own_.refine(share);
  if (reference_) reference_->refine(share);
}

void Painting::complete() {
  own_.complete();
  if (reference_) reference_->complete();
}

bool Painting::isComplete() const {
  return own_.isComplete() && (!reference_ || reference_->isComplete());
}

Image Painting::picture() const {
  return reference_ ? comparisonPicture(own_.image(), reference_->image(), *comparison_)
                    : own_.image();
}

std::optional<ImageMetrics> Painting::errors() const {
  if (!reference_) return std::nullopt;
  return compareImages(reference_->image(), own_.image());
}

std::uint64_t Painting::deviceBytes() const {
  std::uint64_t bytes = 0;
  if (own_.renderer) bytes += own_.renderer->stats().deviceBytes;
  if (reference_ && reference_->renderer) bytes += reference_->renderer->stats().deviceBytes;
  return bytes;
}

}  // namespace esvr::view
