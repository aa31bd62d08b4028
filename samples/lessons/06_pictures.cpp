// Lesson 6: pictures.
//
// A Renderer draws many pictures of one field. It decodes bricks of voxels where rays need them and
// keeps them for the pictures that follow, so it should live as long as its window or its shot.

#include <algorithm>

#include "esvr/error.h"
#include "esvr/fit.h"
#include "esvr/grid_coding.h"
#include "esvr/render.h"
#include "ring.h"

namespace {

// Colors and opacities are functions of the value. Here they cover the values from 0 to 1.
esvr::RenderOptions lookAt(const esvr::SparseVolume& volume) {
  esvr::RenderOptions options;
  options.resolution = {64, 64};
  options.camera = esvr::fitCamera(esvr::activeBox(volume), {}, options.resolution);
  options.transfer = esvr::rescaled(
      {esvr::builtInColorMap("inferno"), esvr::builtInOpacity("linear")}, {0.0f, 1.0f});
  return options;
}

// The pixels of an Image are floats, row by row from the top: red, green, blue and alpha. A program
// copies them to its window. This one prints a character for each 2 x 4 pixels.
void print(const esvr::Image& image) {
  for (int row = 0; row < image.height; row += 4) {
    for (int column = 0; column < image.width; column += 2) {
      const auto pixel = std::size_t(row * image.width + column);
      const float alpha = std::clamp(image.rgba[4 * pixel + 3], 0.0f, 1.0f);
      std::putchar(" .:-=+*#%@"[int(9.0f * alpha)]);
    }
    std::putchar('\n');
  }
}

}  // namespace

int main() {
  const esvr::SparseVolume ring = makeRing();
  esvr::FitOptions fitting;
  fitting.preset = esvr::Preset::kDraft;
  const esvr::StoredGrid grid = esvr::makeStoredGrid({}, ring, esvr::fit(ring, fitting).field);

  // The rule says which voxels are active, as when the grid is decoded. "auto" instead of "cpu"
  // takes a GPU where there is one. Field and grid must outlive the renderer.
  const auto renderer =
      esvr::makeFieldRenderer(grid.field, esvr::selectDevice("cpu"), {}, esvr::voxelRule(grid));
  esvr::RenderOptions options = lookAt(ring);
  const esvr::Image first = renderer->draw(options);
  print(first);
  check(*std::max_element(first.rgba.begin(), first.rgba.end()) > 0.5f, "the ring is visible");
  check(first.rgba[3] == 0.0f, "the corner of the picture is transparent");

  // Another view needs other bricks. Pictures do not depend on what was decoded before.
  const esvr::Camera camera = options.camera;
  options.camera = esvr::turned(camera, 90.0);
  check(renderer->draw(options).rgba != first.rgba, "another view is another picture");
  options.camera = camera;
  check(renderer->draw(options).rgba == first.rgba, "the same view has the same bits");

  // While a user drags the view, a coarse picture at once is better than the whole one later. Each
  // call of refine() draws as many passes as fit into its budget, here 20 ms, and at least one.
  esvr::ProgressivePicture progressive(*renderer, options);
  while (!progressive.refine(0.02)) print(*progressive.image());
  check(progressive.image()->rgba == first.rgba, "the last pass is the picture itself");

  // The picture is that of the decoded voxels.
  const esvr::Image decoded = esvr::renderVolume(esvr::decodeGrid(grid), options);
  float largest = 0.0f;
  for (std::size_t i = 0; i < decoded.rgba.size(); ++i)
    largest = std::max(largest, std::abs(decoded.rgba[i] - first.rgba[i]));
  check(largest < 0.01f, "it is the picture of the decoded voxels");

  // Several grids that have one index space can share a picture. Each has its own transfer function;
  // here the second one glows within the ring and hides nothing. A file's temperature often does.
  const auto pair = esvr::makeGridsRenderer(
      {esvr::DrawnField{&grid.field, esvr::voxelRule(grid)}, &ring}, esvr::selectDevice("cpu"));
  esvr::RenderOptions glowing = options;
  glowing.further = {{options.transfer, /*absorbs=*/false}};
  const esvr::Image glow = pair->draw(glowing);
  check(glow.rgba[4 * (32 * 64 + 32)] >= first.rgba[4 * (32 * 64 + 32)], "light is only added");
  check(glow.rgba != first.rgba, "the second grid is visible");

  // Another thread may cancel a picture that takes too long.
  esvr::CancelToken cancel;
  options.cancel = &cancel;
  cancel.cancel();
  try {
    (void)renderer->draw(options);
    check(false, "a cancelled picture throws");
  } catch (const esvr::Cancelled&) {
    check(true, "a cancelled picture throws");
  }
}
