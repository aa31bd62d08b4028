#pragma once
/// Reads grids of a file, draws them and measures the drawing.

#include <deque>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "esvr/device.h"
#include "esvr/grid_coding.h"
#include "esvr/render.h"
#include "programs/resources.h"
#include "programs/run_main.h"

namespace esvr::render {

/// A grid to draw.
struct Scene {
  std::variant<Field, VolumeGrid> content;
  std::string grid;  ///< name by which users find the grid (GridNames)
  std::string unit;  ///< unit of the values; empty if the grid has none
  Transform transform;
  Box box;          ///< bounding box of the active voxels
  ValueRange data;  ///< range of the active voxels
  float background = 0.0f;
  bool isLevelSet = false;
  std::optional<double> medianDepth{};  ///< LookBasis::medianDepth
  std::optional<StoredGrid> encoded{};  ///< stored grid of the field; none for voxels
};

struct SceneFile {
  std::filesystem::path path;
  std::optional<std::string> grid;  ///< default: the first grid that can be drawn
  std::vector<std::string> with;    ///< further grids, which are drawn in the same picture
  cli::HostMemory memory;           ///< memory that input may take
  /// Without `grid`, this grid is drawn if the file has one of this name that can be drawn.
  std::optional<std::string> preferred{};
};

/// Reads the grid and the further grids of a file.
/// \throws BadInput        the file cannot be read, or has no such grid or none that can be drawn;
///                         the grids differ in their transforms
/// \throws MemoryExceeded  the grids need more than SceneFile::memory
[[nodiscard]] std::vector<Scene> readScenes(const SceneFile& file);

/// The grids of a frame of a sequence.
/// \param file  of the sequence
/// \return nothing if the first grid of SceneFile has nothing active to draw in this frame
/// \throws BadInput  the frame has no such grid; as for readScenes
/// \throws MemoryExceeded  as for readScenes
[[nodiscard]] std::optional<std::vector<Scene>> scenesOf(const EsvrFile& frame,
                                                         const SceneFile& file);

/// The grids of a frame that is a file of its own, otherwise as scenesOf.
[[nodiscard]] std::optional<std::vector<Scene>> readFrame(const SceneFile& file);

/// The same without voxels and ellipsoids, as outlinesOf.
[[nodiscard]] std::optional<std::vector<Scene>> readFrameOutlines(const SceneFile& file,
                                                                  bool measures);

/// The name of the first grid of a .vdb or .nvdb file that can be drawn; nothing if there is none.
[[nodiscard]] std::optional<std::string> firstDrawable(const std::filesystem::path& path);

/// The same as scenesOf without the voxels that the grids may store, which is enough for a camera
/// and transfer functions.
/// \param measures  whether Scene::medianDepth is found, for which stored voxels are decoded
[[nodiscard]] std::optional<std::vector<Scene>> outlinesOf(const EsvrFile& frame,
                                                           const SceneFile& file, bool measures);

/// The same for one of EsvrFile::grids. \param name  by which users find it
[[nodiscard]] Scene outlineOf(const StoredGrid& grid, const std::string& name,
                              const SceneFile& file, bool measures);

/// Widens scenes, so that their boxes and their ranges of values enclose those of others. They keep
/// their median depth if they have one, so that it is that of the first frame.
void enclose(const std::vector<Scene>& others, std::vector<Scene>& scenes);

struct DrawSettings {
  Device device;
  RendererLimits limits;
  std::optional<NanoValues> values;  ///< draw voxels as a NanoVDB grid of this value type
  bool shaded = false;               ///< whether pictures are shaded
  cli::HostMemory memory;            ///< memory that input may take
  bool sums = false;                 ///< whether all pictures are drawn with Between::kSum
};

/// Whether a grid has a sum of ellipsoids to draw. The others are drawn from their voxels, whatever
/// RenderOptions::between says.
[[nodiscard]] bool hasSum(const Scene& scene);

/// Draws a grid, or several grids in one picture. They must outlive it.
class SceneRenderer {
 public:
  /// Voxels are drawn as a NanoVDB grid on a CUDA device, or if `values` asks for one, but not if
  /// pictures are shaded or have several grids. The voxels of a field are decoded when a ray needs
  /// them. If they do not follow from its ellipsoids alone, or lie far apart, all are decoded at once.
  /// \throws DeviceError  the device fails, or its memory is exhausted
  /// \throws MemoryExceeded  voxels that are decoded at once need more than DrawSettings::memory
  SceneRenderer(const std::vector<Scene>& scenes, const DrawSettings& settings);

  Renderer* operator->() { return renderer_.get(); }
  Renderer& operator*() { return *renderer_; }

 private:
  [[nodiscard]] DrawnGrid drawnGrid(const Scene& scene, const DrawSettings& settings);
  void drawAlone(const Scene& scene, const DrawSettings& settings);
  void sampleNano(const VolumeGrid& grid, const DrawSettings& settings);

  std::deque<SparseVolume> decoded_;
  NanoVolume nano_;
  std::unique_ptr<Renderer> renderer_;
};

// The option --bench, which measures the speed, memory and quality of drawing, and the reference pictures of --ref
// (bench.cpp).

struct Benched {
  Renderer& renderer;
  Renderer* reference;   ///< null if there is no --ref
  int referenceSamples;  ///< rays along the side of a pixel in the pictures that are compared with
};

/// Draws the pictures of a full turn, after a few that warm up and do not count. If there is a
/// reference, it is measured in the same way, and up to 36 pictures are compared with it.
/// \param views  number of pictures; 0 stands for 720
/// \throws       as for Renderer::draw
[[nodiscard]] nlohmann::ordered_json bench(const Benched& benched, const RenderOptions& options,
                                           int views, const cli::Log& log);

/// Draws a reference picture, without levels of detail if a pixel has several rays.
/// \param samples  rays along the side of a pixel
[[nodiscard]] Image drawSupersampled(Renderer& renderer, RenderOptions options, int samples);

/// A number for a JSON file. Infinity becomes null, because JSON cannot express it.
[[nodiscard]] nlohmann::ordered_json jsonNumber(double value);

}  // namespace esvr::render
