#pragma once
/// Files that may be damaged.

#include <cmath>
#include <filesystem>
#include <stdexcept>

#include "esvr/error.h"
#include "esvr/vdb_io.h"

namespace esvr::test {

/// Reads all grids of a file; they must be sound and finite.
/// \return false where the file is refused, or where it takes more memory than allowed
inline bool readable(const std::filesystem::path& path, const ReadOptions& options) {
  try {
    for (const auto& listed : inspectVdb(path).grids) {
      if (!listed.skipReason.empty()) continue;
      const auto grid = readGrid(path, listed.uniqueName, options);
      checkInvariants(grid.volume);
      for (const float value : grid.volume.values)
        if (!std::isfinite(value)) throw std::logic_error("a value that is not finite");
    }
  } catch (const BadInput&) {
    return false;
  } catch (const MemoryExceeded&) {
    return false;
  }
  return true;
}

}  // namespace esvr::test
