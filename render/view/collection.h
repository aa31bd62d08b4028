#pragma once
/// The files that the server shows. They are named on the command line; clients name them by
/// numbers.

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "cli/frame_range.h"
#include "render/scene.h"
#include "render/view/scene_json.h"

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

}  // namespace esvr::view
