// esvr.write_splats and esvr.read_splats.

#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <algorithm>
#include <tuple>
#include <variant>

#include "esvr/error.h"
#include "esvr/splats.h"
#include "python/src/objects.h"

namespace esvr::python {
namespace {

using Colors = std::variant<std::string, std::array<double, 3>>;

std::optional<UpAxis> upOf(const std::optional<std::string>& up) {
  if (!up) return std::nullopt;
  if (*up == "y") return UpAxis::kY;
  if (*up == "z") return UpAxis::kZ;
  throw UsageError("up must be 'y', 'z' or None, not '" + *up + "'");
}

/// The form of a file, by its extension.
SplatForm formOf(const std::filesystem::path& path, const std::string& kind) {
  if (kind != "viewer" && kind != "mitsuba")
    throw UsageError("kind must be 'viewer' or 'mitsuba', not '" + kind + "'");
  if (path.extension() == ".usda") return SplatForm::kUsd;
  if (path.extension() != ".ply")
    throw UsageError(path.string() + ": the name of a file of splats must end in .ply or .usda");
  return kind == "mitsuba" ? SplatForm::kMitsuba : SplatForm::kPly;
}

/// Colors over the range of a grid's values and its background.
ColorMap colorsOf(const Colors& colors, const StoredGrid& grid) {
  if (const auto* rgb = std::get_if<std::array<double, 3>>(&colors))
    return {.points = {{0.0, {(*rgb)[0], (*rgb)[1], (*rgb)[2]}}}};
  const auto& name = std::get<std::string>(colors);
  const bool isFile = std::filesystem::path(name).has_extension();
  const ColorMap map = isFile ? readParaViewPreset(name).colors : builtInColorMap(name);
  const auto background = float(grid.descriptor.background);
  const ValueRange range{std::min(grid.valueMin, background), std::max(grid.valueMax, background)};
  return rescaled({map, {{0.0, 1.0}}}, range).colors;
}

double writeSplatsOf(const std::filesystem::path& path, const Grid& grid, const Colors& colors,
                     std::optional<double> densityScale, const std::optional<std::string>& up,
                     const std::string& kind, bool overwrite) {
  return interruptible([&] {
    const SplatForm form = formOf(path, kind);
    const auto made = makeSplats(*grid.grid, {.form = form,
                                              .up = upOf(up),
                                              .colors = colorsOf(colors, *grid.grid),
                                              .densityScale = densityScale,
                                              .maxBytes = usualMemoryLimit()});
    writeSplats(path, made.scene, form, overwrite);
    return made.scene.densityScale;
  });
}

using ReadResult = std::tuple<Volume, std::optional<std::tuple<Volume, Volume, Volume>>>;

ReadResult readSplatsAsGrids(const std::filesystem::path& path, std::optional<double> voxelSize,
                             std::optional<double> densityScale,
                             const std::optional<std::string>& up,
                             const std::optional<std::uint64_t>& maxMemory) {
  return interruptible([&]() -> ReadResult {
    const std::uint64_t limit = memoryLimit(maxMemory);
    const SplatFile file = readSplats(path, {.maxBytes = limit, .up = upOf(up)});
    SplatGrids grids = namingFile(path.string(), [&] {
      return makeSplatGrids(
          file.scene, {.voxelSize = voxelSize, .densityScale = densityScale, .maxBytes = limit});
    });
    const auto asVolume = [](VolumeGrid grid) {
      return Volume{std::make_shared<const VolumeGrid>(std::move(grid))};
    };
    ReadResult result{asVolume(std::move(grids.density)), std::nullopt};
    if (!grids.color) return result;
    std::array<Volume, kComponents> channels;
    for (std::size_t c = 0; c < kComponents; ++c) {
      VolumeGrid channel{.descriptor = grids.color->descriptor,
                         .volume = std::move(grids.color->components[c])};
      channel.descriptor.name = componentName("Cd", c);
      channels[c] = asVolume(std::move(channel));
    }
    std::get<1>(result).emplace(channels[0], channels[1], channels[2]);
    return result;
  });
}

}  // namespace

void addSplats(py::module_& module) {
  module.def(
      "write_splats", &writeSplatsOf, py::arg("path"), py::arg("grid"), py::kw_only(),
      py::arg("colors") = "viridis", py::arg("density_scale") = py::none(), py::arg("up") = "y",
      py::arg("kind") = "viewer", py::arg("overwrite") = false,
      "Writes the ellipsoids of a grid as 3D Gaussian splats to a .ply or .usda file, as esvr2vdb "
      "does.\n\n"
      "colors is the name of a color map, the file of a ParaView preset, or one color (r, g, b).\n"
      "density_scale is the extinction of a value of 1 over a unit of the world; up is 'y' or 'z', "
      "the\n"
      "axis of the world that points upwards, or None for a file with the axes of the world; kind "
      "is\n"
      "'viewer' or 'mitsuba'. Returns the density scale.");
  module.def(
      "read_splats", &readSplatsAsGrids, py::arg("path"), py::kw_only(),
      py::arg("voxel_size") = py::none(), py::arg("density_scale") = py::none(),
      py::arg("up") = "y", py::arg("max_memory") = py::none(),
      "Evaluates the splats of a .ply file at voxels.\n\n"
      "Returns the density (esvr.Volume) and, if the splats have colors, the red, green and "
      "blue of\n"
      "their mean color, else None. voxel_size is by default that of the grid that the splats "
      "were made\n"
      "of, if the file says it, and else 1/256 of the longest side; max_memory is that of "
      "esvr.read.");
}

}  // namespace esvr::python
