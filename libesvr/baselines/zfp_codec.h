#pragma once
/// ZFP on a box of voxels. In a build without ZFP both throw, and say so.

#include <cstddef>
#include <span>
#include <vector>

#include "baselines/dense_box.h"
#include "esvr/baseline.h"

namespace esvr::baselines {

/// A ZFP stream with its header. \throws UsageError  precision out of range, or no ZFP
[[nodiscard]] std::vector<std::byte> compressZfp(const DenseBox& dense, const ZfpSetting& setting);

/// Into an array of the same box. \throws BadInput  not such a stream
void decompressZfp(std::span<const std::byte> bytes, DenseBox& dense);

}  // namespace esvr::baselines
