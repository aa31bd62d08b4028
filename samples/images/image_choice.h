#pragma once
/// What a user chooses of a file that holds several images, and checks that all formats share.

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "esvr/coord.h"

namespace esvr::samples {

struct ImageChoice {
  std::optional<std::int64_t> component{};  ///< from 0 on: color, channel, direction or time
  std::optional<std::string> dataset{};     ///< HDF5: a path in the file; VTI: name of an array
};

/// The chosen one of the components of an image. An image with one component needs no choice.
/// \throws UsageError  the image has several and none is chosen, or the chosen one does not exist;
///                     the text says how many there are
[[nodiscard]] std::size_t chosenComponent(const std::filesystem::path& path,
                                          const ImageChoice& choice, std::uint64_t components);

/// Refuses the choice of a dataset for a format without datasets.
/// \throws UsageError  a dataset is chosen
void refuseDataset(const std::filesystem::path& path, const ImageChoice& choice);

/// A size of a file as a Coord.
/// \throws BadInput  an axis has no voxels or more than 2^31 - 1
[[nodiscard]] Coord checkedSize(const std::filesystem::path& path,
                                const std::array<std::uint64_t, 3>& size);

/// Refuses what does not fit into the memory of the machine.
/// \param what  for the message: "a strip or a tile"
/// \throws MemoryExceeded
void requireMemory(const std::filesystem::path& path, const std::string& what, double bytes);

/// Refuses an image of which a slab of kBrickSide slices does not fit into the memory.
/// \param voxelBytes  bytes of a voxel in the file
/// \throws MemoryExceeded
void requireSlabMemory(const std::filesystem::path& path, Coord size, std::size_t voxelBytes);

/// The matrix of an image without a place in space (ImageSource::indexToWorld).
/// \param spacing  edges of a voxel along x, y and z
[[nodiscard]] std::array<double, 16> scaleMatrix(const std::array<double, 3>& spacing);

}  // namespace esvr::samples
