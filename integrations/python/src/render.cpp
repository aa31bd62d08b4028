// esvr.Grid.render and esvr.Volume.render.

#include "esvr/render.h"

#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <algorithm>
#include <cmath>

#include "esvr/error.h"
#include "esvr/grid_coding.h"
#include "python/src/objects.h"

namespace esvr::python {
namespace {

struct Look {
  Resolution resolution;
  CameraWish camera;
  std::string colors;
  std::optional<std::string> opacity;  ///< nothing: the usual one
  std::string device;
  std::optional<std::filesystem::path> transfer;
  std::optional<std::array<float, 2>> range;
  double step = 1.0, opacityLength = 1.0;
  std::optional<std::array<double, 3>> background;
};

/// What a picture needs to know of a grid or a volume.
struct Subject {
  Box box;
  LookBasis look;
  VoxelShape voxel;
};

/// As esvr-render: an affine transform gives the voxels their shape; a frustum is not applied, and a
/// warning says so.
VoxelShape voxelOf(const GridDescriptor& grid) {
  if (const auto shape = voxelShape(grid.transform.affine)) return *shape;
  const std::string text =
      "the transform of '" + grid.name +
      "' is a frustum or has no inverse, and is not applied; voxels are drawn as cubes";
  if (PyErr_WarnEx(PyExc_UserWarning, text.c_str(), kCaller) != 0) throw py::error_already_set();
  return {};
}

/// The function of esvr-render: the usual look unless something else is asked for.
TransferFunction transferOf(const Look& look, const Subject& subject) {
  if (look.transfer) {
    const TransferFunction own = readParaViewPreset(*look.transfer);
    return look.range ? rescaled(own, {(*look.range)[0], (*look.range)[1]}) : own;
  }
  const LookBasis& grid = subject.look;
  const bool isSurface = grid.isLevelSet && grid.background > 0.0f;
  if (!look.range && (isSurface || !look.opacity)) return usualLook(grid, look.colors);
  ValueRange range = grid.range;
  range.expand(grid.background);
  if (look.range) range = {(*look.range)[0], (*look.range)[1]};
  return rescaled({builtInColorMap(look.colors), builtInOpacity(look.opacity.value_or("linear"))},
                  range);
}

RenderOptions optionsOf(const Look& look, const Subject& subject) {
  if (subject.box.empty()) throw UsageError("there is no active voxel to draw");
  RenderOptions options;
  options.resolution = look.resolution;
  CameraWish wish = look.camera;
  wish.voxel = subject.voxel;
  options.camera = fitCamera(subject.box, wish, look.resolution);
  options.transfer = transferOf(look, subject);
  options.step = look.step;
  options.opacityLength = look.opacityLength;
  return options;
}

/// The colors of a pixel in front of a background, or not premultiplied if there is none.
std::array<float, 4> shown(const float* rgba, const Look& look) {
  const float alpha = rgba[3];
  if (!look.background) {
    if (alpha <= 0.0f) return {};
    return {rgba[0] / alpha, rgba[1] / alpha, rgba[2] / alpha, alpha};
  }
  const auto& behind = *look.background;
  const auto over = [&](int c) { return rgba[c] + (1.0f - alpha) * float(behind[c]); };
  return {over(0), over(1), over(2), 1.0f};
}

py::array_t<std::uint8_t> bytesOf(const Image& image, const Look& look) {
  constexpr py::ssize_t kChannels = 4;
  py::array_t<std::uint8_t> array({py::ssize_t(image.height), py::ssize_t(image.width), kChannels});
  std::uint8_t* to = array.mutable_data();
  for (std::size_t pixel = 0; pixel < image.rgba.size(); pixel += kChannels) {
    const auto color = shown(&image.rgba[pixel], look);
    for (int c = 0; c < kChannels; ++c)
      *to++ = std::uint8_t(std::lround(255.0f * std::clamp(color[c], 0.0f, 1.0f)));
  }
  return array;
}

/// \param make  makes the renderer for a device
template <class Make>
py::array_t<std::uint8_t> drawn(const Look& look, const Subject& subject, const Make& make) {
  const RenderOptions options = optionsOf(look, subject);
  const Image image = interruptible([&](CancelToken& token) {
    RenderOptions cancellable = options;
    cancellable.cancel = &token;
    return make(selectDevice(look.device))->draw(cancellable);
  });
  return bytesOf(image, look);
}

/// Voxels that are not finite are empty.
py::array_t<std::uint8_t> drawVolume(const Volume& self, const Look& look) {
  const bool areFinite = !hasNonFinite(self.grid->volume);
  SparseVolume finite;
  if (!areFinite) finite = self.grid->volume, dropNonFinite(finite);
  const SparseVolume& volume = areFinite ? self.grid->volume : finite;
  const GridDescriptor& grid = self.grid->descriptor;
  return drawn(look, {activeBox(volume), lookBasis(grid, volume), voxelOf(grid)},
               [&](const Device& device) { return makeVolumeRenderer(volume, device); });
}

py::array_t<std::uint8_t> drawGrid(const Grid& self, const Look& look) {
  const StoredGrid& grid = *self.grid;
  if (!followsFromEllipsoids(grid)) return drawVolume(decoded(self, std::nullopt), look);
  const Subject subject{grid.activeBox, lookBasis(grid, kNoMemoryLimit), voxelOf(grid.descriptor)};
  return drawn(look, subject, [&](const Device& device) {
    return makeFieldRenderer(grid.field, device, {}, voxelRule(grid));
  });
}

constexpr const char* kRenderText =
    "Draws a picture: sRGB, uint8 of shape (height, width, 4).\n\n"
    "The grid has its proportions in the world: eye, center and up are in the axes of the world,\n"
    "from the place of voxel (0, 0, 0), in units of the shortest edge of a voxel, as for\n"
    "esvr-render. For cubes along the axes these are index coordinates. A frustum is drawn in "
    "index\n"
    "coordinates, with a warning. What is not given is chosen so that the picture shows\n"
    "everything. colors and opacity are names of esvr-render, whose usual opacity is taken if "
    "none\n"
    "is given; transfer is a ParaView preset.\n"
    "range has the values at the ends of the transfer function. Without a background (r, g, b), "
    "the\n"
    "alpha channel is the opacity, and colors are not premultiplied.";

/// Adds the method `render` to a class.
template <class Subject>
void addRenderTo(py::handle type, py::array_t<std::uint8_t> (*draw)(const Subject&, const Look&)) {
  using Point = std::optional<Vec3>;
  auto method = py::cpp_function(
      [draw](const Subject& self, int width, int height, const Point& eye, const Point& center,
             const Point& up, std::optional<double> fov, const std::string& colors,
             const std::optional<std::string>& opacity,
             const std::optional<std::filesystem::path>& transfer,
             const std::optional<std::array<float, 2>>& range, double step, double opacityLength,
             const std::optional<std::array<double, 3>>& background, const std::string& device) {
        return draw(self, {{width, height},
                           {.eye = eye, .center = center, .up = up, .fov = fov},
                           colors,
                           opacity,
                           device,
                           transfer,
                           range,
                           step,
                           opacityLength,
                           background});
      },
      py::name("render"), py::is_method(type), py::arg("width") = 800, py::arg("height") = 800,
      py::kw_only(), py::arg("eye") = py::none(), py::arg("center") = py::none(),
      py::arg("up") = py::none(), py::arg("fov") = py::none(), py::arg("colors") = "viridis",
      py::arg("opacity") = py::none(), py::arg("transfer") = py::none(),
      py::arg("range") = py::none(), py::arg("step") = 1.0, py::arg("opacity_length") = 1.0,
      py::arg("background") = py::none(), py::arg("device") = "auto", kRenderText);
  py::setattr(type, "render", method);
}

}  // namespace

void addRender(py::module_& module) {
  addRenderTo<Volume>(module.attr("Volume"), &drawVolume);
  addRenderTo<Grid>(module.attr("Grid"), &drawGrid);
}

}  // namespace esvr::python
