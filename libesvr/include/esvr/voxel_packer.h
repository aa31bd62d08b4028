#pragma once
/// A grid's voxels as OpenVDB's and NanoVDB's own files hold them, in every form that those offer:
/// what an .esvr is measured against. Written and read by the two libraries themselves, and timed;
/// for files that are meant to be kept there is writeGrids (vdb_io.h).

#include <filesystem>
#include <memory>
#include <string>

#include "esvr/nano_volume.h"
#include "esvr/vdb_io.h"

namespace esvr {

enum class PackedForm {
  kOpenVdbFloat,
  kOpenVdbHalf,
  kNanoFloat,
  kNanoFp16,  ///< 16 bits a voxel between a leaf's smallest and largest value
  kNanoFp8,
  kNanoFp4,
  kNanoFpN,  ///< as many bits a leaf as VoxelPacking::tolerance needs
};

enum class PackedCodec { kNone, kZip, kBlosc };

struct VoxelPacking {
  PackedForm form = PackedForm::kOpenVdbFloat;
  PackedCodec codec = PackedCodec::kBlosc;
  double tolerance = 0.0;  ///< kNanoFpN: largest error of a voxel, in value units; above 0
};

[[nodiscard]] bool isNanoVdb(PackedForm form);
/// The values that a NanoVDB grid of the form holds; kFloat for OpenVDB's forms.
[[nodiscard]] NanoValues nanoValues(PackedForm form);

class VoxelPacker {
 public:
  /// Builds the OpenVDB grid that files are made of. Constant leaves become tiles.
  explicit VoxelPacker(const VolumeGrid& grid);
  ~VoxelPacker();
  VoxelPacker(const VoxelPacker&) = delete;
  VoxelPacker& operator=(const VoxelPacker&) = delete;

  /// Writes a file and replaces what is there. OpenVDB packs no level sets and fog volumes by zip,
  /// so that for kZip such a grid's class is written as unknown. Every OpenVDB file leaves out
  /// inactive values.
  /// \return seconds from OpenVDB's grid to the written file
  /// \throws UsageError  values that half cannot hold; a transform that NanoVDB cannot; no
  ///                     tolerance; RuntimeFailure: not writable
  double write(const std::filesystem::path& path, const VoxelPacking& packing) const;

 private:
  struct Source;
  std::unique_ptr<Source> source_;
};

/// Seconds that the form's own library takes to have a file's grid in memory, as OpenVDB's tree or
/// NanoVDB's buffer. \throws BadInput  not such a file
[[nodiscard]] double secondsToRead(const std::filesystem::path& path, PackedForm form);

}  // namespace esvr
