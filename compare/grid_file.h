#pragma once
/// A file of grids, whatever its kind.

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "esvr/container.h"
#include "esvr/vdb_io.h"

namespace esvr::compare {

/// A grid as its file lists it.
struct ListedGrid {
  std::string name{};        ///< as stored
  std::string uniqueName{};  ///< with "[i]" where several share the name
  bool comparable = true;    ///< of floats
  bool empty = false;        ///< without an active voxel
  std::string valueType;
};

/// A .esvr by its ending, else a .vdb or .nvdb by its first bytes.
class GridFile {
 public:
  /// \throws BadInput, MemoryExceeded  as readEsvr and inspectVdb
  /// \param maxMemory  bytes that reading it may take
  GridFile(std::filesystem::path path, std::uint64_t maxMemory);

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }
  [[nodiscard]] const std::vector<ListedGrid>& grids() const { return grids_; }
  [[nodiscard]] const std::vector<MetaItem>& metadata() const { return metadata_; }
  /// Null but for an .esvr.
  [[nodiscard]] const EsvrFile* esvr() const { return esvr_.get(); }

  /// Place of a grid by the name that a user gives. \throws BadInput  as findGrid
  [[nodiscard]] std::size_t find(const std::string& name) const;
  /// The first grid that holds voxels of floats. \throws BadInput  there is none
  [[nodiscard]] std::size_t firstWithVoxels() const;
  /// The voxels; none where the grid is empty. \throws BadInput  not of floats; as readGrid
  [[nodiscard]] VolumeGrid read(std::size_t grid) const;

 private:
  void listEsvr();
  void listVdb();

  std::filesystem::path path_;
  std::uint64_t maxMemory_;
  std::uint64_t bytes_ = 0;
  std::vector<ListedGrid> grids_;
  std::vector<MetaItem> metadata_;
  std::unique_ptr<EsvrFile> esvr_;
};

}  // namespace esvr::compare
