#pragma once
/// ZFP on a box of voxels. In a build without ZFP both functions throw UsageError.

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "baselines/dense_box.h"
#include "esvr/baseline.h"

namespace esvr::baselines {

inline constexpr unsigned kMaxZfpPlanes = 32;  ///< bit planes of a float

/// Compresses an array to a ZFP stream with a header.
/// \param grid  name of the array's grid, for messages
/// \throws UsageError  the precision is out of range, the box has more than 65,536 voxels along an
///                     axis, or the build has no ZFP
[[nodiscard]] std::vector<std::byte> compressZfp(const DenseBox& dense, const ZfpSetting& setting,
                                                 const std::string& grid);

/// Decompresses a stream to an array of the same box.
/// \param file  name of the stream's file, for messages
/// \throws BadInput  the stream does not belong to such an array
void decompressZfp(std::span<const std::byte> bytes, const std::filesystem::path& file,
                   DenseBox& dense);

}  // namespace esvr::baselines
