#pragma once
/// The content of a file, to be drawn.

#include <filesystem>
#include <optional>
#include <string>
#include <variant>

#include "esvr/grid_coding.h"
#include "esvr/memory_limit.h"
#include "esvr/renderer.h"

namespace esvr::render {

struct Scene {
  std::variant<Field, VolumeGrid> content;
  std::string grid;  ///< its name
  Box box;           ///< around the active voxels
  ValueRange data;   ///< over the active voxels
  float background = 0.0f;
  std::optional<StoredGrid> encoded{};  ///< the grid that a field was read from
};

struct SceneFile {
  std::filesystem::path path;
  std::optional<std::string> grid;           ///< nothing: the first that can be drawn
  std::uint64_t maxMemory = kNoMemoryLimit;  ///< bytes
};

/// \throws BadInput  the file cannot be read, has no such grid or none that can be drawn;
///                   MemoryExceeded
[[nodiscard]] Scene readScene(const SceneFile& file);

/// The device and the way of drawing.
enum class Method { kEllipsoids, kBricks, kAuto };

struct DrawSettings {
  Device device;
  Method method = Method::kEllipsoids;  ///< the way to draw a field
  RendererLimits limits;
  std::optional<NanoValues> values;          ///< march voxels as a NanoVDB grid of these
  std::uint64_t maxMemory = kNoMemoryLimit;  ///< bytes that decoding may take
};

/// Draws a scene, which must outlive it.
class SceneRenderer {
 public:
  /// Voxels are marched as a NanoVDB grid on a CUDA device, or where `values` asks for one. A field
  /// is drawn by Method: its ellipsoids; its voxels, decoded once; or, by trying both with `sample`
  /// once each, what is faster and fits. \throws DeviceError
  SceneRenderer(const Scene& scene, const DrawSettings& settings, const RenderOptions& sample);

  Renderer* operator->() { return renderer_.get(); }
  Renderer& operator*() { return *renderer_; }

 private:
  void drawField(const Field& field, const Scene& scene, const DrawSettings& settings,
                 const RenderOptions& sample);
  void sampleVoxels(const VolumeGrid& grid, const DrawSettings& settings);

  SparseVolume decoded_;
  NanoVolume nano_;
  std::unique_ptr<Renderer> renderer_;
};

}  // namespace esvr::render
