#include "images/image_choice.h"

#include <algorithm>
#include <limits>

#include "cli/memory.h"
#include "esvr/error.h"
#include "esvr/sparse_volume.h"

namespace esvr::samples {

std::size_t chosenComponent(const std::filesystem::path& path, const ImageChoice& choice,
                            std::uint64_t components) {
  const auto index = choice.component.value_or(components == 1 ? 0 : -1);
  if (index >= 0 && std::uint64_t(index) < components) return std::size_t(index);
  const std::string range = components == 1 ? "0" : "0 to " + std::to_string(components - 1);
  throw UsageError(path.string() + " has " + std::to_string(components) + " component" +
                   (components == 1 ? "" : "s") + "; --component must be " + range +
                   (choice.component ? ", not " + std::to_string(index) : ""));
}

void refuseDataset(const std::filesystem::path& path, const ImageChoice& choice) {
  if (choice.dataset)
    throw UsageError("--dataset is for HDF5 and VTI images only, and " + path.string() +
                     " is another one");
}

Coord checkedSize(const std::filesystem::path& path, const std::array<std::uint64_t, 3>& size) {
  constexpr std::uint64_t kMost = std::numeric_limits<std::int32_t>::max();
  for (const std::uint64_t length : size)
    if (length < 1 || length > kMost)
      throw BadInput(path.string() + ": an axis has " + std::to_string(length) +
                     " voxels; 1 to 2^31 - 1 are allowed");
  return {std::int32_t(size[0]), std::int32_t(size[1]), std::int32_t(size[2])};
}

void requireMemory(const std::filesystem::path& path, const std::string& what, double bytes) {
  const auto memory = cli::physicalMemory();
  if (bytes <= double(memory)) return;
  constexpr double kMegabyte = 1e6;
  throw MemoryExceeded(path.string() + ": " + what + " takes " +
                       std::to_string(std::uint64_t(std::min(bytes / kMegabyte, 1e18))) +
                       " MB, but the machine has " +
                       std::to_string(std::uint64_t(double(memory) / kMegabyte)) + " MB");
}

void requireSlabMemory(const std::filesystem::path& path, Coord size, std::size_t voxelBytes) {
  const double slices = std::min<std::int32_t>(size.z, kBrickSide);
  const double bytes = double(sizeof(float)) + double(voxelBytes);
  requireMemory(path, std::to_string(int(slices)) + " slices",
                double(size.x) * double(size.y) * slices * bytes);
}

std::array<double, 16> scaleMatrix(const std::array<double, 3>& spacing) {
  return {spacing[0], 0, 0, 0, 0, spacing[1], 0, 0, 0, 0, spacing[2], 0, 0, 0, 0, 1};
}

}  // namespace esvr::samples
