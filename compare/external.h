#pragma once
/// The option --external: rows for the results of other systems, which need not be installed.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "cli/host_memory.h"
#include "esvr/coord.h"
#include "esvr/memory_limit.h"
#include "esvr/sparse_volume.h"

namespace esvr::compare {

/// An external result: NAME=FILE:BYTES, with :DIMS:TYPE if FILE is raw, and any of :encode=S,
/// :decode=S, :fps=N.
struct External {
  std::string text;  ///< text of the option
  std::string name;
  std::filesystem::path file;
  std::uint64_t bytes = 0;
  std::optional<Coord> dims;  ///< size of a raw file in voxels, x fastest
  std::string type;           ///< "float32", "float64", "uint8" or "uint16", little-endian
  std::optional<double> encodeSeconds, decodeSeconds, fps;
};

/// \throws UsageError  the text is not of this form
[[nodiscard]] External parseExternal(const std::string& text);

/// The place of an external result's voxels.
struct ExternalPlace {
  std::string grid;  ///< grid of a VDB file; a file's only grid may have another name
  Box box;           ///< box of the voxels of a raw file
  float background = 0.0f;
  cli::HostMemory memory;  ///< memory that input may take
};

/// Reads the voxels. In a raw file, voxels that differ from the background are active.
/// \throws BadInput  the file is missing, is not a VDB or does not have its stated size; a value is
///                   not finite
[[nodiscard]] SparseVolume readExternal(const External& external, const ExternalPlace& place);

}  // namespace esvr::compare
