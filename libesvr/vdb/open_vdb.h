#pragma once
/// The library's functions as OpenVDB and NanoVDB carry them out. The source files of this folder
/// define each function where its subject is.

#include "vdb/library.h"

namespace esvr::vdb {

class OpenVdb final : public Library {
 public:
  [[nodiscard]] std::string vdbVersions() const override;
  [[nodiscard]] VdbSummary inspectVdb(const std::filesystem::path& path) const override;
  [[nodiscard]] VolumeGrid readGrid(const std::filesystem::path& path, std::size_t place,
                                    const ReadOptions& options) const override;
  [[nodiscard]] VolumeGrid readComponent(const std::filesystem::path& path, std::size_t place,
                                         std::size_t component,
                                         const ReadOptions& options) const override;
  [[nodiscard]] VectorGrid readVector(const std::filesystem::path& path, std::size_t place,
                                      const ReadOptions& options) const override;
  [[nodiscard]] PackedGrid readPacked(const std::filesystem::path& path, std::size_t place,
                                      const ReadOptions& options) const override;
  [[nodiscard]] std::vector<CarriedGrid> readCarried(const std::filesystem::path& path,
                                                     std::span<const std::size_t> places,
                                                     const ReadOptions& options) const override;
  [[nodiscard]] GridSummary inspectCarried(const CarriedGrid& grid) const override;
  [[nodiscard]] VolumeGrid readGrid(const CarriedGrid& grid,
                                    const ReadOptions& options) const override;
  [[nodiscard]] VectorGrid readVector(const CarriedGrid& grid,
                                      const ReadOptions& options) const override;
  [[nodiscard]] PackedGrid readPacked(const CarriedGrid& grid,
                                      const ReadOptions& options) const override;
  void writeGrids(const std::filesystem::path& path, std::span<const MetaItem> fileMetadata,
                  std::span<const GridToWrite> grids, const WriteOptions& options) const override;
  [[nodiscard]] Transform uniformTransform(double voxelSize) const override;
  [[nodiscard]] Transform affineTransform(const std::array<double, 16>& matrix) const override;
  [[nodiscard]] MeshDistance meshDistance(const VolumeGrid& reference,
                                          const VolumeGrid& candidate) const override;
  [[nodiscard]] NanoVolume makeNanoVolume(const VolumeGrid& grid, NanoValues values) const override;
  [[nodiscard]] std::unique_ptr<const Packer> makePacker(const VolumeGrid& grid) const override;
  [[nodiscard]] double secondsToRead(const std::filesystem::path& path,
                                     PackedForm form) const override;
};

}  // namespace esvr::vdb
