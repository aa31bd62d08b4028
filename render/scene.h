#pragma once
/// Reads the content of a file and draws it.

#include <filesystem>
#include <optional>
#include <string>
#include <variant>

#include "cli/host_memory.h"
#include "esvr/grid_coding.h"
#include "esvr/memory_limit.h"
#include "esvr/renderer.h"

namespace esvr::render {

struct Scene {
  std::variant<Field, VolumeGrid> content;
  std::string grid;  ///< name of the grid
  std::string unit;  ///< unit of the values; empty if the grid has none
  Box box;           ///< bounding box of the active voxels
  ValueRange data;   ///< range of the active voxels
  float background = 0.0f;
  bool isLevelSet = false;
  std::optional<StoredGrid> encoded{};  ///< stored grid of the field; none for voxels
};

struct SceneFile {
  std::filesystem::path path;
  std::optional<std::string> grid;  ///< default: the first grid that can be drawn
  cli::HostMemory memory;           ///< memory that input may take
};

/// \throws BadInput        the file cannot be read, or has no such grid or none that can be drawn
/// \throws MemoryExceeded  the grid needs more than SceneFile::maxMemory
[[nodiscard]] Scene readScene(const SceneFile& file);

/// The grid of a frame of a sequence.
/// \param file  of the sequence
/// \return nothing if the frame has nothing active to draw
/// \throws BadInput  the frame has no such grid
/// \throws MemoryExceeded  as for readScene
[[nodiscard]] std::optional<Scene> sceneOf(const EsvrFile& frame, const SceneFile& file);

/// The same without the voxels that the grid may store, which is enough for a camera and a transfer
/// function.
[[nodiscard]] std::optional<Scene> outlineOf(const EsvrFile& frame, const SceneFile& file);

/// Widens a scene, so that its box and its range of values enclose those of another one.
void enclose(const Scene& other, Scene& scene);

struct DrawSettings {
  Device device;
  RendererLimits limits;
  std::optional<NanoValues> values;  ///< draw voxels as a NanoVDB grid of this value type
  bool shaded = false;               ///< whether pictures are shaded
  cli::HostMemory memory;            ///< memory that input may take
};

/// Draws a scene, which must outlive it.
class SceneRenderer {
 public:
  /// Voxels are drawn as a NanoVDB grid on a CUDA device, or if `values` asks for one, but not if
  /// pictures are shaded. The voxels of
  /// a field are decoded when a ray needs them. If they do not follow from its ellipsoids alone, all
  /// are decoded at once.
  /// \throws DeviceError  the device fails, or its memory is exhausted
  SceneRenderer(const Scene& scene, const DrawSettings& settings);

  Renderer* operator->() { return renderer_.get(); }
  Renderer& operator*() { return *renderer_; }

 private:
  void drawField(const Field& field, const StoredGrid& grid, const DrawSettings& settings);
  void sampleVoxels(const VolumeGrid& grid, const DrawSettings& settings);

  SparseVolume decoded_;
  NanoVolume nano_;
  std::unique_ptr<Renderer> renderer_;
};

}  // namespace esvr::render
