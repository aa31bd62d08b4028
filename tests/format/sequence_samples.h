#pragma once
/// Small files of sequences.

#include <cstdint>
#include <filesystem>
#include <vector>

#include "esvr/container.h"

namespace esvr::test {

/// A frame with a grid of voxels and ellipsoids that depends on the number. Frames whose number is
/// a multiple of 5 have no grids.
[[nodiscard]] EsvrFile sampleFrame(std::int64_t number);

/// Writes groups of frames, which refer to no other frame.
void writeSequence(const std::filesystem::path& path,
                   const std::vector<std::vector<std::int64_t>>& groups);

/// The same, but all frames except the first ones of groups say that they refer to the frame before
/// them. Their bytes do not need it.
void writeChains(const std::filesystem::path& path,
                 const std::vector<std::vector<std::int64_t>>& groups);

/// Writes the golden sequence: the frames -2 and 1 in one group, and frame 3 in another one. They
/// are the golden files one_ellipsoid, no_grid and voxels.
void writeGoldenSequence(const std::filesystem::path& path);

[[nodiscard]] std::vector<std::byte> bytesIn(const std::filesystem::path& path);
void writeBytes(const std::filesystem::path& path, const std::vector<std::byte>& bytes);

}  // namespace esvr::test
