#pragma once
/// --external: another system's result gets its row without that system being here.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "esvr/coord.h"
#include "esvr/memory_limit.h"
#include "esvr/sparse_volume.h"

namespace esvr::compare {

/// NAME=FILE:BYTES, with :DIMS:TYPE where FILE is raw, and any of :encode=S, :decode=S, :fps=N.
struct External {
  std::string text;  ///< as given
  std::string name;
  std::filesystem::path file;
  std::uint64_t bytes = 0;
  std::optional<Coord> dims;  ///< of a raw file, x fastest
  std::string type;           ///< "float32", "float64", "uint8", "uint16"; little-endian
  std::optional<double> encodeSeconds, decodeSeconds, fps;
};

/// \throws UsageError  not of that form
[[nodiscard]] External parseExternal(const std::string& text);

/// Where an external's voxels belong.
struct ExternalPlace {
  std::string grid;  ///< of a VDB file; where it has only one grid, that one
  Box box;           ///< of a raw file
  float background = 0.0f;
  std::uint64_t maxMemory = kNoMemoryLimit;  ///< bytes that reading may take
};

/// The voxels that came back. Of a raw file, those that differ from the background are active.
/// \throws BadInput  missing, of another size than it says, not a number at a voxel, not a VDB
[[nodiscard]] SparseVolume readExternal(const External& external, const ExternalPlace& place);

}  // namespace esvr::compare
