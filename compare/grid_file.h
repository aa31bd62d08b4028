#pragma once
/// Files of grids in any format, and the frames of sequences.

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "esvr/container.h"
#include "esvr/grid.h"
#include "esvr/sequence_file.h"
#include "esvr/vdb_io.h"
#include "programs/files.h"
#include "programs/resources.h"
#include "programs/sequence.h"

namespace esvr::compare {

/// An entry of a file's list of grids.
struct ListedGrid {
  std::string name{};        ///< stored name
  std::string uniqueName{};  ///< GridNames::unique
  bool comparable = true;    ///< true if the values are floats or doubles
  bool empty = false;        ///< true if there is no active voxel
  std::string valueType;
  std::uint64_t storedBytes = 0;  ///< bytes of the grid in a .vdb file
  GridOfFile ofEsvr{};            ///< place in the content of an .esvr file
  bool isVector = false;          ///< true if readVectors can read it
};

/// An .esvr file is recognised by its extension, a .vdb or .nvdb file by its first bytes.
class GridFile {
 public:
  /// \throws BadInput, MemoryExceeded  as readEsvr and inspectVdb
  /// \param memory  memory that reading it may take
  GridFile(std::filesystem::path path, cli::HostMemory memory);

  /// A frame of a sequence. \param path  of the file that holds it, for error texts
  GridFile(std::filesystem::path path, const EsvrFile& frame, cli::HostMemory memory);

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }
  [[nodiscard]] const std::vector<ListedGrid>& grids() const { return grids_; }
  [[nodiscard]] const std::vector<MetaItem>& metadata() const { return metadata_; }
  /// The content of an .esvr file; null for other files.
  [[nodiscard]] const EsvrFile* esvr() const { return esvr_.get(); }

  /// Index of a grid by the name that a user gives. \throws BadInput  as for GridNames::findWhole
  [[nodiscard]] std::size_t find(const std::string& name) const;
  [[nodiscard]] const GridNames& names() const { return *names_; }
  /// What tells grids of one name apart, in the order of grids().
  [[nodiscard]] const std::vector<GridTraits>& traits() const { return traits_; }
  /// Index of the first comparable grid with an active voxel. \throws BadInput  there is none
  [[nodiscard]] std::size_t firstWithVoxels() const;
  /// Whether bytesOf() has the bytes of a grid.
  [[nodiscard]] bool hasBytes(std::size_t grid) const;
  /// A grid as the bytes that OpenVDB wrote; nothing if the file does not have them, because the
  /// grid was fitted or the file is a .nvdb. \throws BadInput, MemoryExceeded  as for readCarried
  [[nodiscard]] std::optional<CarriedGrid> bytesOf(std::size_t grid) const;
  /// The voxels of a grid, which may be empty.
  /// \throws BadInput  the values are not floats or doubles; else as for readGrid
  [[nodiscard]] VolumeGrid read(std::size_t grid) const;
  /// The vectors of a grid. \throws BadInput  the grid has not ListedGrid::isVector
  [[nodiscard]] VectorGrid readVectors(std::size_t grid) const;

 private:
  [[nodiscard]] ReadOptions reading() const;
  void listEsvr();
  void listVdb();
  void nameGrids();

  /// The list and each grid of a VDB file are read at different times.
  template <class Value>
  [[nodiscard]] Value ofSameFile(Value value) const {
    watched_.requireUnchanged();
    return value;
  }

  std::filesystem::path path_;
  cli::WatchedInputs watched_;
  cli::HostMemory memory_;
  std::shared_ptr<const vdb::ArchiveDirectory> directory_;  ///< of a .vdb file
  std::uint64_t bytes_ = 0;
  std::vector<ListedGrid> grids_;
  std::vector<GridTraits> traits_;
  std::optional<GridNames> names_;
  std::vector<std::string> whyNoBytes_;  ///< why bytesOf() has no figures; VDB files only
  std::vector<MetaItem> metadata_;
  std::unique_ptr<EsvrFile> esvr_;
};

/// The frames of a sequence: a file each, or all in one .esvr file.
class FrameSource {
 public:
  /// The sequence that a path names: a pattern, or a file that holds a sequence.
  /// \return null if the path is that of a single file
  /// \throws BadInput  the file is damaged; no file matches the pattern
  [[nodiscard]] static std::unique_ptr<FrameSource> in(const std::string& path,
                                                       const cli::HostMemory& memory);

  /// Says which names look like frames of the pattern and are none; empty if there are none.
  /// \param wanted  the numbers in question; null: all
  [[nodiscard]] std::string hint(const std::vector<cli::FrameNumber>* wanted) const {
    const std::string text = listing_.hint(wanted);
    return text.empty() ? text : pattern_.text() + ": " + text;
  }

  /// The numbers of the frames, increasing.
  [[nodiscard]] const std::vector<cli::FrameNumber>& numbers() const { return listing_.frames; }

  /// Reads a frame. \throws BadInput, MemoryExceeded  as for readEsvr and inspectVdb
  [[nodiscard]] GridFile open(cli::FrameNumber number);

  /// Bytes of some frames; those of a file that holds a sequence are its own.
  [[nodiscard]] std::uint64_t bytesOf(const std::vector<cli::FrameNumber>& frames) const;

 private:
  FrameSource(cli::FramePattern pattern, const cli::HostMemory& memory)
      : pattern_(std::move(pattern)), memory_(memory) {}

  cli::FramePattern pattern_;
  cli::HostMemory memory_;
  cli::FrameListing listing_;               ///< The frames of a file that has all of them.
  std::unique_ptr<SequenceReader> reader_;  ///< null: each frame is a file
};

}  // namespace esvr::compare
