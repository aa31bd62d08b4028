#pragma once
/// Makes files with NanoVDB's own writer.

#include <openvdb/Grid.h>

#include <filesystem>

#include "esvr/nano_volume.h"

namespace esvr::test {

enum class NanoCodec { kNone, kZip, kBlosc };

/// Writes grids of floats, doubles or vectors of three floats.
void saveNano(const std::filesystem::path& path, const openvdb::GridPtrVec& grids,
              NanoCodec codec = NanoCodec::kNone);
/// Writes a grid of floats in one of NanoVDB's value types.
void saveNanoAs(const std::filesystem::path& path, const openvdb::GridBase& grid,
                NanoValues values);

}  // namespace esvr::test
