#pragma once
/// The files that the server shows, which are named on the command line, and their grids that are
/// ready to be drawn. Clients name files and grids by numbers.

#include <cstdint>
#include <filesystem>
#include <list>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "esvr/sequence_file.h"
#include "programs/sequence.h"
#include "render/scene.h"
#include "render/view/requests.h"

namespace esvr::view {

/// A grid that can be drawn.
struct ShownGrid {
  std::string name;  ///< unique in its file, as for --grid of esvr-render
  std::string kind;  ///< how the file stores it: "ellipsoids", "voxels" or "vdb"
  std::string gridClass;
  /// The grid without its content, as one scene. For a sequence it encloses all frames.
  std::vector<render::Scene> outline;
  std::uint64_t ellipsoids = 0, bytes = 0, activeVoxels = 0;  ///< of the first frame
};

struct ShownFile {
  std::filesystem::path path;
  std::uint64_t bytes = 0;
  std::vector<cli::FrameNumber> frames;  ///< empty: the file holds no sequence
  std::vector<ShownGrid> grids;
};

/// Reads what a file holds.
/// \throws BadInput, MemoryExceeded  as for readScenes; nothing in the file can be drawn
[[nodiscard]] ShownFile showFile(const std::filesystem::path& path, const cli::HostMemory& memory);

class Collection {
 public:
  /// \throws BadInput, MemoryExceeded  as for showFile
  Collection(const std::vector<std::filesystem::path>& paths, const cli::HostMemory& memory);

  [[nodiscard]] const std::vector<ShownFile>& files() const { return files_; }

  /// \throws BadInput  there is no such file, grid or frame
  [[nodiscard]] const ShownGrid& gridAt(const GridPlace& place) const;
  [[nodiscard]] const ShownFile& fileAt(const GridPlace& place) const;
  /// The frame of a place; nothing if its file holds no sequence. \throws BadInput  as for gridAt
  [[nodiscard]] std::optional<cli::FrameNumber> frameAt(const GridPlace& place) const;

 private:
  std::vector<ShownFile> files_;
};

/// A grid of a frame with its renderers, which keep what they decoded for earlier pictures.
class Drawable {
 public:
  Drawable(std::vector<render::Scene> scenes, render::DrawSettings settings)
      : scenes_(std::move(scenes)), settings_(std::move(settings)) {}

  /// The renderer of shaded or of other pictures, which is made when it is first needed.
  /// \throws DeviceError  as for SceneRenderer
  [[nodiscard]] Renderer& renderer(bool shaded);

  /// Calls visit(volume) with the voxels, which are decoded for this if they are not stored.
  /// \throws MemoryExceeded  they need too much memory
  template <class Visit>
  auto withVoxels(Visit&& visit) const {
    if (const auto* grid = std::get_if<VolumeGrid>(&scenes_.front().content))
      return visit(grid->volume);
    const auto& memory = settings_.memory;
    return visit(decodeGrid(
        *scenes_.front().encoded,
        {.maxBytes = memory.maxBytes, .memory = memory.voxels, .keepsNonFinite = false}));
  }

 private:
  const std::vector<render::Scene> scenes_;
  const render::DrawSettings settings_;
  std::optional<render::SceneRenderer> plain_, shaded_;
};

/// Reads grids when they are first drawn, and keeps those that were drawn last. All functions are
/// called from one thread.
class Drawables {
 public:
  Drawables(const Collection& collection, render::DrawSettings settings)
      : collection_(collection), settings_(std::move(settings)) {}

  /// \return null if nothing is active in the grid's frame
  /// \throws BadInput  there is no such grid; as for readScenes
  /// \throws MemoryExceeded  as for readScenes
  [[nodiscard]] std::shared_ptr<Drawable> get(GridPlace place);

 private:
  [[nodiscard]] std::optional<std::vector<render::Scene>> scenesAt(const GridPlace& place);
  [[nodiscard]] SequenceReader& readerOf(std::size_t file);

  struct Kept {
    GridPlace place;
    std::shared_ptr<Drawable> drawable;
  };
  const Collection& collection_;
  const render::DrawSettings settings_;
  std::list<Kept> kept_;  ///< the one that was drawn last comes first
  std::map<std::size_t, SequenceReader> readers_;
};

}  // namespace esvr::view
