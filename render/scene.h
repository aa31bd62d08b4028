#pragma once
/// What there is to draw in a file.

#include <filesystem>
#include <optional>
#include <string>
#include <variant>

#include "esvr/renderer.h"

namespace esvr::render {

struct Scene {
  std::variant<Field, VolumeGrid> content;
  std::string grid;  ///< its name
  Box box;           ///< of the active voxels
  ValueRange data;   ///< over the active voxels
  float background = 0.0f;
};

/// \param grid  nothing: the first that can be drawn
/// \throws BadInput  the file cannot be read, has no such grid or none that can be drawn
[[nodiscard]] Scene readScene(const std::filesystem::path& path,
                              const std::optional<std::string>& grid);

/// Where and how to draw.
struct DrawSettings {
  Device device;
  RendererLimits limits;
  std::optional<NanoValues> values;  ///< march voxels as a NanoVDB grid of these
};

/// Draws a scene, which must outlive it.
class SceneRenderer {
 public:
  /// Voxels are marched as a NanoVDB grid on a CUDA device, or where `values` asks for one.
  /// \throws DeviceError
  SceneRenderer(const Scene& scene, const DrawSettings& settings);

  Renderer* operator->() { return renderer_.get(); }
  Renderer& operator*() { return *renderer_; }

 private:
  NanoVolume nano_;
  std::unique_ptr<Renderer> renderer_;
};

}  // namespace esvr::render
