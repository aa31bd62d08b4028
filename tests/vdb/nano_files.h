#pragma once
/// Files made with NanoVDB's own writer. Its templates take minutes to compile: they are in one
/// translation unit, which nothing speeds up by being optimised.

#include <openvdb/openvdb.h>

#include <filesystem>

namespace esvr::test {

enum class NanoCodec { kNone, kZip, kBlosc };
enum class NanoFloats { kFp4, kFp8, kFp16, kFpN };

void saveNano(const std::filesystem::path& path, const openvdb::GridPtrVec& grids,
              NanoCodec codec = NanoCodec::kNone);
void saveQuantised(const std::filesystem::path& path, openvdb::FloatGrid& grid, NanoFloats floats);

}  // namespace esvr::test
