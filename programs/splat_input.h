#pragma once
/// Files of splats as input of a program: their options, and the grids that become of them.

#include <filesystem>
#include <optional>

#include "esvr/splats.h"
#include "programs/command_line.h"
#include "programs/resources.h"
#include "programs/run_main.h"

namespace esvr::cli {

/// What options say about splats in the input.
struct SplatInput {
  std::optional<double> voxelSize, densityScale;
  std::optional<UpAxis> up = UpAxis::kY;
};

/// Adds --voxel-size, --density-scale and --up.
void addSplatInput(
    po::options_description& options,
    const char* voxelSize =
        "side of a voxel of a grid made of splats, in units of the world (default: as in "
        "the grid that they are from, or 1/256 of the longest side of their box)");

/// \throws UsageError  an option is invalid
[[nodiscard]] SplatInput splatInputOf(const Arguments& arguments);

/// True if the name of a file says that it has splats.
[[nodiscard]] bool isSplatFile(const std::filesystem::path& path);

/// Reads splats, makes grids of them, and says what was left out.
/// \throws BadInput, MemoryExceeded  as for readSplats and makeSplatGrids
[[nodiscard]] SplatGrids readSplatGrids(const std::filesystem::path& path, const SplatInput& input,
                                        const HostMemory& memory, const Log& log);

/// The grids of splats as a .vdb file for programs that read such files. It is in a folder of its own, which is
/// removed with this object.
class SplatsAsVdb {
 public:
  struct Source {
    std::filesystem::path path, scratch;  ///< file of splats, and where the folder is made
    SplatInput input;
    HostMemory memory;
  };
  /// \throws BadInput, MemoryExceeded  as for readSplatGrids
  /// \throws RuntimeFailure  the file cannot be written
  SplatsAsVdb(const Source& source, const Log& log);
  ~SplatsAsVdb();
  SplatsAsVdb(const SplatsAsVdb&) = delete;
  SplatsAsVdb& operator=(const SplatsAsVdb&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path folder_, path_;
};

}  // namespace esvr::cli
