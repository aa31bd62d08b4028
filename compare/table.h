#pragma once
/// esvr-compare table, the paper's tables for any volume.

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "compare/external.h"
#include "compare/figures.h"
#include "compare/table_record.h"
#include "esvr/baseline.h"
#include "esvr/device.h"
#include "esvr/image.h"
#include "esvr/render.h"
#include "esvr/vdb_io.h"
#include "esvr/volume.h"
#include "programs/resources.h"
#include "programs/run_main.h"

namespace esvr::compare {

struct NamedTransfer {
  std::string name;
  TransferFunction function;  ///< function that is rescaled to the range of the reference's values
};

/// The option --images.
struct GalleryOptions {
  int views = 0;  ///< number of views of a full turn; 0: no pictures
  Resolution resolution{400, 400};
  double step = 1.0;
  std::vector<NamedTransfer> transfers;
  /// Shell command that gets the files of the reference and a picture as arguments (8-bit PNG in front
  /// of black), and whose last word is a figure of both, for example LPIPS; empty: none
  std::string lpips;
};

/// The files of a report; empty for those that are not written.
struct ReportFiles {
  std::string json, markdown, csv, html;
  bool overwrite = false;
};

struct TableOptions {
  cli::InputFiles inputs;  ///< reference, candidates and transfer functions
  std::filesystem::path reference;
  std::vector<std::filesystem::path> candidates;
  std::optional<std::string> grid;  ///< default: the first grid with voxels
  bool lossless = true, quantised = true, matched = true, zfp = true;
  std::vector<BaselineSetting> settings;  ///< baselines of --row, which replace the others
  std::vector<std::uint64_t> sizes;       ///< sizes to match besides the candidates'
  std::vector<double> psnrs;              ///< PSNRs over the box to match, dB
  std::vector<double> activePsnrs;        ///< PSNRs over the active voxels to match, dB
  std::vector<std::uint64_t> fits;        ///< sizes for which ellipsoids are fitted
  bool fitDefault = false;                ///< whether a fit with the default options is made
  bool fitPaper = false;                  ///< whether a fit by the paper's method is made
  std::vector<External> externals;
  std::vector<ExternalCommand> commands;  ///< compressors that a command runs
  int runs = 3;
  std::uint64_t maxDense = 0;
  std::optional<Box> box;
  std::optional<double> peak;
  std::string device;
  GalleryOptions images;
  ReportFiles files;
  cli::HostMemory memory;  ///< memory that input may take
  int threads = 0;
  cli::Verbosity verbosity = cli::Verbosity::kNormal;
  std::vector<std::string> commandLine;
};

/// \param argv  arguments, beginning with the command ("table")
/// \return nothing if --help or --version was printed
/// \throws UsageError  an option is invalid
[[nodiscard]] std::optional<TableOptions> parseTableOptions(int argc, const char* const* argv);

// Pictures (gallery.cpp).

/// The views of a table: draws the reference once, and compares the pictures of each row with it.
class Gallery {
 public:
  /// Draws the reference on a device.
  /// \param folder  folder for temporary files
  /// \throws UsageError, Cancelled, DeviceError  as for renderVolume and makeVolumeRenderer
  Gallery(const GalleryOptions& options, const SparseVolume& reference, const Device& device,
          const std::filesystem::path& folder, const CancelToken& cancel);

  struct Compared {
    ImageFigures figures;
    Shown shown;
  };
  /// \throws RuntimeFailure  the command of GalleryOptions fails, or its last word is not a number; else
  ///                         as for Renderer::draw
  [[nodiscard]] Compared compare(Renderer& renderer) const;
  [[nodiscard]] const std::string& referencePng() const { return referencePng_; }
  /// The cost of drawing the reference; only fps and deviceBytes are set.
  [[nodiscard]] const ImageFigures& referenceCost() const { return referenceCost_; }
  [[nodiscard]] const Device& device() const { return device_; }

 private:
  std::vector<RenderOptions> views_;
  Device device_;
  std::string lpips_;
  std::filesystem::path folder_;
  std::vector<Image> references_;
  std::string referencePng_;
  ImageFigures referenceCost_;
};

/// Makes the renderer of a row's pictures. On a CUDA device it draws a NanoVDB grid of this value type,
/// and on the CPU the volume itself.
/// \throws DeviceError  as for makeNanoRenderer
[[nodiscard]] std::unique_ptr<Renderer> makeVoxelRenderer(const SparseVolume& volume,
                                                          NanoValues values, const Device& device);

// The command.

/// Reads the reference and makes all rows (rows.cpp). If the run is interrupted, finished rows are kept.
/// \throws BadInput  the reference has no active voxel, or cannot be compared; as for readGrid
[[nodiscard]] TableRecord makeRows(const TableOptions& options, const CancelToken& cancel,
                                   const cli::Log& log);

/// Makes the rows, prints them and writes the reports.
/// \throws BadInput  the files cannot be compared
/// \throws RuntimeFailure  the run was interrupted; finished rows were printed and written
void table(const TableOptions& options);

}  // namespace esvr::compare
