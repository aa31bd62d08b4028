#pragma once
/// Other systems: results that they have left (--external), compressors that a command runs
/// (--external-command), and commands of the user in general.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "esvr/baseline.h"
#include "esvr/device.h"
#include "esvr/volume.h"
#include "programs/resources.h"

namespace esvr::compare {

/// What a command printed on its standard output.
/// \param option  option that has the command, for the message of an error
/// \throws RuntimeFailure  its exit code is not 0; the text has the last line that was read
[[nodiscard]] std::string outputOf(const std::string& command, const std::string& option);

/// The result of a system that need not be installed: NAME=FILE:BYTES, with :DIMS:TYPE if FILE is
/// raw, and any of :encode=S, :decode=S, :fps=N.
struct External {
  std::string text;  ///< text of the option
  std::string name;
  std::filesystem::path file;
  std::uint64_t bytes = 0;
  std::optional<Coord> dims;  ///< size of a raw file in voxels, x fastest
  std::string type;           ///< "float32", "float64", "uint8" or "uint16", little-endian
  std::optional<double> encodeSeconds, decodeSeconds, fps;
};

/// \throws UsageError  the text is not of this form
[[nodiscard]] External parseExternal(const std::string& text);

/// The place of an external result's voxels.
struct ExternalPlace {
  std::string grid;  ///< grid of a VDB file; a file's only grid may have another name
  Box box;           ///< box of the voxels of a raw file
  float background = 0.0f;
  cli::HostMemory memory;  ///< memory that input may take
};

/// Reads the voxels. In a raw file, voxels that differ from the background are active.
/// \throws BadInput  the file is missing, is not a VDB or does not have its stated size; a value is
///                   not finite
[[nodiscard]] SparseVolume readExternal(const External& external, const ExternalPlace& place);

/// A compressor of arrays, NAME=COMMAND. The command is called as
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

/// One trial of a search.
struct ExternalStep {
  double bound = 0.0;
  std::uint64_t bytes = 0;
  double psnr = 0.0;  ///< dB over the voxels of the search; NaN if it did not need it
};

struct ExternalMatch {
  bool found = false;
  ExternalStep best;
  std::vector<ExternalStep> steps;  ///< all trials, in order
};

/// What a row is searched for: a file of at most this many bytes with the highest PSNR, or one that
/// reaches a PSNR with the fewest bytes.
using RowGoal = std::variant<std::uint64_t, MatchGoal>;

/// Searches a bound for a goal. Bounds fall from the peak in steps of 10 until one is too small, and
/// the last step is bisected until a file is at most 2 % smaller than the size, or exceeds the PSNR
/// by at most 0.05 dB. MatchGoal::dropsVoxels has no meaning here.
[[nodiscard]] ExternalMatch match(ExternalCodec& codec, const RowGoal& goal);

}  // namespace esvr::compare
