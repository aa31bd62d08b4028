#pragma once
/// The data of a table, and its reports.

#include <cstdint>
#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

#include "esvr/fit.h"
#include "esvr/metrics.h"
#include "esvr/volume.h"

namespace esvr::compare {

/// Statistics of the times of several runs, seconds.
struct Timing {
  double median = 0.0, min = 0.0, max = 0.0;
  int runs = 0;
};

/// A trial of the search for a row's setting.
struct SearchStep {
  std::string setting;
  std::uint64_t bytes = 0;
  std::optional<double> psnr;
};

/// Mean figures over all pictures; the PSNR is that of the mean squared error.
struct ImageFigures {
  double psnr = 0.0, ssim = 0.0, flip = 0.0;
  double fps = 0.0;                            ///< pictures per second by the median drawing time
  std::optional<std::uint64_t> deviceBytes{};  ///< CUDA memory of the renderer
  std::optional<double> lpips{};               ///< LPIPS if a command was given
};

/// The first picture of a row and its map of errors in the colors of report::errorScale().
struct Shown {
  std::string picturePng, errorPng;
};

/// Names of groups.
inline constexpr const char *kOurGroup = "ESVR", *kExternalGroup = "external",
                            *kLosslessGroup = "lossless", *kNearlyLosslessGroup = "nearly lossless",
                            *kQuantisedGroup = "quantised";

struct TableRow {
  std::string name;  ///< name, for example "NanoVDB FpN Zip"
  /// One of the names above, or "given", "at 48214 bytes", "at 44.70 dB".
  std::string group;
  /// Value for --row, or "bound=B" of an external command; empty if the row is neither.
  std::string setting{};
  std::string command{};
  std::optional<std::uint64_t> matchedBytes{};  ///< size that the row was searched for
  std::optional<double> matchedPsnr{};          ///< PSNR that the row was searched for, dB
  std::optional<std::uint64_t> bytes{};
  std::optional<VolumeMetrics> metrics{};
  std::optional<Timing> encode{}, decode{};
  std::optional<std::uint64_t> memory{};
  std::optional<double> fps{};
  std::optional<ImageFigures> images{};
  Shown shown{};                         ///< pictures that `images` measures
  std::vector<TimedCurvePoint> curve{};  ///< curve of a fit
  bool fittedHere = false;               ///< true if `encode` includes the fit
  std::string note{};  ///< remark on the figures, or the reason why there are none
  std::vector<SearchStep> search{};
};

struct TableRecord {
  std::string grid;
  std::uint64_t referenceBytes = 0;  ///< size of the reference's file
  std::optional<std::uint64_t> halfBlosc;
  Box box;
  double peak = 0.0;
  std::uint64_t activeVoxels = 0;
  std::vector<TableRow> rows;
  std::string referencePng{};                   ///< picture of the reference, if there are pictures
  std::optional<ImageFigures> referenceCost{};  ///< cost of drawing the reference
  std::string drawnOn{};                        ///< name of the device that draws
  bool interrupted = false;
};

struct TableOptions;

// The rows as text, Markdown, CSV, JSON and HTML (report_parts.cpp).

/// Prints the table with at most 100 characters in a line, unless a name is longer.
/// \param search  whether the trials of the searches are printed
void printTable(const TableRecord& record, bool search, std::ostream& out);

/// Writes all wanted files. \throws RuntimeFailure  a file is not writable
void writeReports(const TableOptions& options, const TableRecord& record);

}  // namespace esvr::compare
