#include "render/view/painting.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "render/look.h"

namespace esvr::view {

RenderOptions renderOptionsOf(const Collection& collection, const SceneWish& scene,
                              Resolution size) {
  render::Options options = scene.options;
  options.resolution = size;
  return render::renderOptions(options, collection.gridAt(scene.place).outline);
}

namespace {

constexpr std::size_t kChannels = 4;

Image splitPicture(const Image& image, Image picture, double split) {
  const std::size_t row = kChannels * std::size_t(image.width);
  const std::size_t left = kChannels * std::size_t(std::lround(split * image.width));
  for (std::size_t i = 0; i < image.rgba.size(); i += row)
    std::copy_n(&image.rgba[i], left, &picture.rgba[i]);
  return picture;
}

Image differencePicture(const Image& image, Image picture, double gain) {
  for (std::size_t i = 0; i < picture.rgba.size(); ++i)
    picture.rgba[i] = i % kChannels == kChannels - 1
                          ? 1.0f
                          : float(gain) * std::abs(picture.rgba[i] - image.rgba[i]);
  return picture;
}

}  // namespace

Image comparisonPicture(const Image& image, const Image& reference, const Comparison& comparison) {
  switch (comparison.show) {
    case CompareShow::kSplit:
      return splitPicture(image, reference, comparison.split);
    case CompareShow::kDifference:
      return differencePicture(image, reference, comparison.gain);
    case CompareShow::kReference:
      break;
  }
  return reference;
}

Painting::Part::Part(const Input& input, const GridPlace& place, RenderOptions of)
    : drawable(input.drawables.get(place)), options(std::move(of)) {
  options.cancel = input.cancel;
  if (drawable) {
    renderer = &drawable->renderer(options.shading.has_value());
    passes.emplace(*renderer, options);
  } else {
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
      own_(input, input.scene.place, renderOptionsOf(input.collection, input.scene, input.size)) {
  // The reference is drawn like the grid.
  if (comparison_) reference_.emplace(input, comparison_->with, own_.options);
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
