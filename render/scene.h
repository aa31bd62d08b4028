#pragma once
/// What there is to draw in a file.

#include <filesystem>
#include <optional>
#include <string>
#include <variant>

#include "esvr/render.h"

namespace esvr::render {

struct Scene {
  std::variant<Field, SparseVolume> content;
  std::string grid;  ///< its name
  Box box;           ///< of the active voxels
  ValueRange data;   ///< over the active voxels
  float background = 0.0f;
};

/// \param grid  nothing: the first that can be drawn
/// \throws BadInput  the file cannot be read, has no such grid or none that can be drawn
[[nodiscard]] Scene readScene(const std::filesystem::path& path,
                              const std::optional<std::string>& grid);

[[nodiscard]] Image draw(const Scene& scene, const RenderOptions& options);

}  // namespace esvr::render
