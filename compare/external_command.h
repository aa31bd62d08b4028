#pragma once
/// The option --external-command: a compressor of arrays that a command of the user runs.

#include <cstdint>
#include <filesystem>
#include <string>

#include "cli/host_memory.h"
#include "esvr/coord.h"
#include "esvr/progress.h"
#include "esvr/sparse_volume.h"

namespace esvr::compare {

/// NAME=COMMAND. The command is called as
///
///     COMMAND encode RAW PACKED NX NY NZ BOUND
///     COMMAND decode PACKED RAW NX NY NZ BOUND
///
/// RAW holds float32 values, little-endian, with x fastest. BOUND is a positive number in units of
/// the values; a smaller one makes a better and larger file. PACKED is what is measured.
struct ExternalCommand {
  std::string text;  ///< text of the option
  std::string name;
  std::string command;
};

/// \throws UsageError  the text is not of this form
[[nodiscard]] ExternalCommand parseExternalCommand(const std::string& text);

/// What a command is run on.
struct ExternalSource {
  const SparseVolume& volume;
  Box box;                       ///< box whose voxels are stored
  double peak = 1.0;             ///< peak value of the PSNR
  std::filesystem::path folder;  ///< folder for temporary files
  std::uint64_t maxDense = 0;    ///< limit on the box as an array of floats, bytes; 0: no limit
  cli::HostMemory memory;        ///< memory that decoded voxels may take
  const CancelToken* cancel = nullptr;
};

/// Encodes and decodes one box at various bounds, one after the other.
class ExternalCodec {
 public:
  /// Writes the box as a raw file.
  /// \throws UsageError  the box as an array is larger than the limit
  ExternalCodec(const ExternalCommand& command, const ExternalSource& source);

  struct Encoded {
    std::uint64_t bytes = 0;
    double seconds = 0.0;  ///< time of the command, with its start and its files
  };
  /// \throws RuntimeFailure  the command fails or leaves no file
  /// \throws Cancelled   ExternalSource::cancel was set
  Encoded encode(double bound);
  /// Seconds of the command that decodes the last encoded file.
  double secondsToDecode();
  /// The voxels of the last encoded file. No mask is stored; a voxel is active if it differs from
  /// the background by more than half of the smallest such difference of an active voxel of the
  /// source.
  /// \throws BadInput  the decoded file does not have the size of the box, or a value that is not
  ///                   finite
  [[nodiscard]] SparseVolume decode();

  [[nodiscard]] const ExternalSource& source() const { return source_; }

 private:
  void run(const char* job, const std::filesystem::path& from,
           const std::filesystem::path& to) const;

  const ExternalCommand& command_;
  ExternalSource source_;
  std::filesystem::path raw_, packed_, decoded_;
  float activeAbove_ = 0.0f;
  double bound_ = 0.0;
};

/// The text of a bound, without loss of digits.
[[nodiscard]] std::string boundText(double bound);

}  // namespace esvr::compare
