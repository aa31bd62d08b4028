#pragma once
/// The functions of libesvr that need OpenVDB or NanoVDB, behind one interface, so that a process can
/// load OpenVDB when it needs it for the first time. Debian's libopenvdb takes a process about 30 ms
/// to load, most of the time of a short command (docs/benchmarks.md).
///
/// A static libesvr has a library() that is linked with OpenVDB (linked_library.cpp). The programs
/// and a shared libesvr have one that loads a module (loaded_library.cpp).

#include <array>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "esvr/mesh_distance.h"
#include "esvr/nano_volume.h"
#include "esvr/vdb_io.h"
#include "esvr/voxel_packer.h"

namespace esvr::vdb {

/// What a VoxelPacker does.
class Packer {
 public:
  virtual ~Packer() = default;
  virtual double write(const std::filesystem::path& path, const VoxelPacking& packing) const = 0;
};

/// The functions have the names, arguments and errors of the public ones. Grids are given by their places.
class Library {
 public:
  virtual ~Library() = default;

  [[nodiscard]] virtual std::string vdbVersions() const = 0;
  [[nodiscard]] virtual VdbSummary inspectVdb(const std::filesystem::path& path) const = 0;
  [[nodiscard]] virtual VolumeGrid readGrid(const std::filesystem::path& path, std::size_t place,
                                            const ReadOptions& options) const = 0;
  [[nodiscard]] virtual VolumeGrid readComponent(const std::filesystem::path& path,
                                                 std::size_t place, std::size_t component,
                                                 const ReadOptions& options) const = 0;
  [[nodiscard]] virtual VectorGrid readVector(const std::filesystem::path& path, std::size_t place,
                                              const ReadOptions& options) const = 0;
  [[nodiscard]] virtual PackedGrid readPacked(const std::filesystem::path& path, std::size_t place,
                                              const ReadOptions& options) const = 0;
  [[nodiscard]] virtual std::vector<CarriedGrid> readCarried(const std::filesystem::path& path,
                                                             std::span<const std::size_t> places,
                                                             const ReadOptions& options) const = 0;
  [[nodiscard]] virtual GridSummary inspectCarried(const CarriedGrid& grid) const = 0;
  [[nodiscard]] virtual VolumeGrid readGrid(const CarriedGrid& grid,
                                            const ReadOptions& options) const = 0;
  [[nodiscard]] virtual VectorGrid readVector(const CarriedGrid& grid,
                                              const ReadOptions& options) const = 0;
  [[nodiscard]] virtual PackedGrid readPacked(const CarriedGrid& grid,
                                              const ReadOptions& options) const = 0;
  virtual void writeGrids(const std::filesystem::path& path, std::span<const MetaItem> fileMetadata,
                          std::span<const GridToWrite> grids,
                          const WriteOptions& options) const = 0;
  [[nodiscard]] virtual Transform uniformTransform(double voxelSize) const = 0;
  [[nodiscard]] virtual Transform affineTransform(const std::array<double, 16>& matrix) const = 0;
  [[nodiscard]] virtual MeshDistance meshDistance(const VolumeGrid& reference,
                                                  const VolumeGrid& candidate) const = 0;
  [[nodiscard]] virtual NanoVolume makeNanoVolume(const VolumeGrid& grid,
                                                  NanoValues values) const = 0;
  [[nodiscard]] virtual std::unique_ptr<const Packer> makePacker(const VolumeGrid& grid) const = 0;
  [[nodiscard]] virtual double secondsToRead(const std::filesystem::path& path,
                                             PackedForm form) const = 0;
};

/// \throws RuntimeFailure  the module is to be loaded, and cannot be
[[nodiscard]] const Library& library();

/// The file name of the module, and the C function in it that returns the `const Library*`. It takes the
/// program's CancelSlot, so that the loops of the module are cancelled like those of the program.
inline constexpr const char* kModule = "esvr_vdb.so";
inline constexpr const char* kModuleFunction = "esvrVdbLibrary";

}  // namespace esvr::vdb
