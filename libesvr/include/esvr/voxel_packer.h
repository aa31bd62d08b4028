#pragma once
/// Writes a grid in every form of OpenVDB and NanoVDB files, as baselines for .esvr files. The
/// files are written and read by the two libraries, and the times are measured. To write files for
/// users, call writeGrids (vdb_io.h).

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
  kNanoFp16,  ///< 16 bits per voxel between the smallest and the largest value of a leaf
  kNanoFp8,
  kNanoFp4,
  kNanoFpN,  ///< the number of bits of a leaf follows from VoxelPacking::tolerance
};

enum class PackedCodec { kNone, kZip, kBlosc };

struct VoxelPacking {
  PackedForm form = PackedForm::kOpenVdbFloat;
  PackedCodec codec = PackedCodec::kBlosc;
  double tolerance = 0.0;  ///< largest error of a voxel for kNanoFpN, in value units; above 0
};

[[nodiscard]] bool isNanoVdb(PackedForm form);
/// The value type of a NanoVDB grid of this form; kFloat for OpenVDB's forms.
[[nodiscard]] NanoValues nanoValues(PackedForm form);

class VoxelPacker {
 public:
  /// Builds the OpenVDB grid that the files are written from. Constant leaves become tiles.
  explicit VoxelPacker(const VolumeGrid& grid);
  ~VoxelPacker();
  VoxelPacker(const VoxelPacker&) = delete;
  VoxelPacker& operator=(const VoxelPacker&) = delete;

  /// Writes a file and replaces an existing one. OpenVDB does not zip level sets and fog volumes;
  /// with kZip the class of such a grid is therefore written as unknown. OpenVDB files do not hold
  /// inactive values.
  /// \return seconds from OpenVDB's grid to the written file
  /// \throws UsageError  half floats cannot hold a value, NanoVDB cannot hold the transform, or the
  ///                     tolerance is missing
  /// \throws RuntimeFailure  the file is not writable
  double write(const std::filesystem::path& path, const VoxelPacking& packing) const;

 private:
  struct Source;
  std::unique_ptr<const Source> source_;
};

/// Seconds that the form's own library takes to read a file's grid into memory, as OpenVDB's tree
/// or NanoVDB's buffer.
/// \throws BadInput  the file is not of this form
[[nodiscard]] double secondsToRead(const std::filesystem::path& path, PackedForm form);

}  // namespace esvr
