#pragma once
/// The data of a table, what it has found, and its reports.

#include <cstdint>
#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

#include "esvr/fit.h"
#include "esvr/metrics.h"
#include "esvr/volume.h"
#include "programs/page_figures.h"

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

// What a table has found: ESVR beside its best rivals, and the order of the rows on a page that shows it (finding.cpp).

/// A row of ESVR and its best rival.
struct Duel {
  const TableRow* ours;
  const TableRow* rival;  ///< null: there is none
};

/// A rival may be larger than the row of ESVR by this share, as files of matched sizes are smaller
/// by up to this share.
inline constexpr double kSameSize = 0.02;

/// The duels of all rows of ESVR, by size. The best rival is the row with the highest PSNR over the
/// box among the rows that are not larger, whatever their group; among equal ones, the smallest. If
/// the row of ESVR has no error, it is the smallest row of any size without an error.
[[nodiscard]] std::vector<Duel> duelsOf(const TableRecord& record);

/// How many dB ESVR has more than its rival; infinite if only one of them has an error, NaN if none
/// has. \param duel  a duel with a rival
[[nodiscard]] double leadOf(const Duel& duel);

/// The finding in one sentence. Further ones say how many files of ESVR have no rival, and what its
/// file without an error takes.
/// Empty if there is no row of ESVR.
[[nodiscard]] std::string findingOf(const TableRecord& record);

/// Rows under one heading of a page.
struct RowGroup {
  std::string heading;
  std::vector<const TableRow*> rows;
  bool ofOneSize = false;  ///< whether the rows were searched for one size
};

/// Each row of ESVR, the rows of its size and those of its PSNR come first. The other groups keep
/// their order and follow.
class PageOrder {
 public:
  /// \param record  must outlive the order
  explicit PageOrder(const TableRecord& record);

  [[nodiscard]] const std::vector<RowGroup>& groups() const { return groups_; }
  [[nodiscard]] const std::vector<Duel>& duels() const { return duels_; }
  [[nodiscard]] report::Emphasis emphasisOf(const TableRow& row) const;

 private:
  void addSize(const TableRow& ours);
  void addUnplaced(const TableRow& row, RowGroup group);

  const TableRecord& record_;
  std::vector<Duel> duels_;
  std::vector<RowGroup> groups_;
};

struct TableOptions;

// The rows as text, Markdown, CSV, JSON and HTML (table_report.cpp).

/// Prints the table with at most 100 characters in a line, unless a name is longer.
/// \param search  whether the trials of the searches are printed
void printTable(const TableRecord& record, bool search, std::ostream& out);

/// Writes all wanted files. \throws RuntimeFailure  a file is not writable
void writeReports(const TableOptions& options, const TableRecord& record);

}  // namespace esvr::compare
