#pragma once
/// The rows of a table: the reference, the baselines that are compared with it, and
/// the measurement of one row after the other from the same voxels.

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "compare/external.h"
#include "compare/gallery.h"
#include "compare/grid_file.h"
#include "compare/table.h"
#include "compare/table_record.h"
#include "esvr/baseline.h"
#include "esvr/encode.h"

namespace esvr::compare {

/// The reference and the settings that all rows share.
struct TableScene {
  const TableOptions& options;
  std::string gridName;  ///< unique name in the reference
  const VolumeGrid& reference;
  std::vector<MetaItem> metadata;  ///< metadata of the reference file
  Box box;
  double peak = 1.0;
  std::filesystem::path folder;  ///< folder for temporary files
  const CancelToken& cancel;
  const Gallery* gallery = nullptr;  ///< null: no pictures
};

/// A folder for temporary files in that of the variable TMPDIR, or in /var/tmp. The destructor
/// removes it with its content.
class ScratchFolder {
 public:
  /// \throws UsageError  TMPDIR is no folder
  /// \throws RuntimeFailure  the folder cannot be made
  ScratchFolder();
  ~ScratchFolder();
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

/// Reads and checks the reference, and owns the objects that a TableScene points to.
class SceneFiles {
 public:
  /// \throws BadInput  the reference has no active voxel; else as for readGrid
  SceneFiles(const TableOptions& options, const CancelToken& cancel);

  [[nodiscard]] TableScene scene() const;
  /// A record without rows.
  [[nodiscard]] TableRecord record() const;

 private:
  const TableOptions& options_;
  const CancelToken& cancel_;
  GridFile file_;
  std::size_t place_;
  VolumeGrid reference_;
  Box box_;
  double peak_;
  ScratchFolder folder_;
  std::optional<Gallery> gallery_;
};

/// The baseline to which ratios refer.
[[nodiscard]] BaselineSetting halfBlosc();

[[nodiscard]] std::vector<BaselineSetting> losslessSettings();

/// A setting and the name of its row.
struct NamedSetting {
  BaselineSetting setting;
  std::string name;
};
[[nodiscard]] std::vector<NamedSetting> quantisedSettings(double peak);

/// The forms for which the best setting for a size, or for a PSNR, is searched; none if --row names
/// the baselines.
[[nodiscard]] std::vector<BaselineSetting> sizeForms(const TableOptions& options);
[[nodiscard]] std::vector<BaselineSetting> psnrForms(const TableOptions& options);
/// Forms that are matched to a PSNR over the active voxels.
[[nodiscard]] std::vector<BaselineSetting> activePsnrForms(const TableOptions& options);

/// A fit that a row is to show.
struct FitWish {
  std::optional<std::uint64_t> bytes{};  ///< size of the file; nothing: default options
  bool paper = false;                    ///< whether the paper's method is used, stored as float32
};

/// The name of a row: "NanoVDB FpN Zip", "ZFP accuracy".
[[nodiscard]] std::string displayName(const BaselineSetting& setting);

/// Makes one row after the other.
class RowMaker {
 public:
  explicit RowMaker(const TableScene& scene);

  /// If a row cannot be made, its note has the reason. \throws Cancelled  the run was interrupted
  TableRow baseline(const std::string& group, const BaselineSetting& setting,
                    const std::string& name);
  /// Searches the best setting of the form of `like` for a size or a PSNR.
  TableRow sizeMatched(const BaselineSetting& like, std::uint64_t bytes);
  TableRow psnrMatched(const BaselineSetting& like, const MatchGoal& goal);
  TableRow external(const External& external);
  /// Searches the best bound of an external command for a size or a PSNR.
  TableRow sizeMatched(const ExternalCommand& command, std::uint64_t bytes);
  TableRow psnrMatched(const ExternalCommand& command, const MatchGoal& goal);
  /// \throws BadInput  the candidate does not have the grid, or its voxels lie elsewhere
  TableRow candidate(const std::filesystem::path& path);
  /// Fits ellipsoids.
  TableRow fitted(const FitWish& wish);

 private:
  void measure(const BaselineSetting& setting, TableRow& row);
  TableRow matched(const ExternalCommand& command, const TableRow& row,
                   const std::function<ExternalMatch(ExternalCodec&)>& search);
  void measure(ExternalCodec& codec, double bound, TableRow& row);
  TableRow matched(const BaselineSetting& like, const std::string& group,
                   const std::function<Match()>& search);
  /// \param head  size of a file without grids, bytes
  [[nodiscard]] Conversion convert(const FitWish& wish, std::uint64_t head) const;
  void measureEsvr(const std::filesystem::path& path, TableRow& row);
  [[nodiscard]] VolumeMetrics compare(const SparseVolume& volume) const;
  /// Measures the voxels and, if wanted, their pictures.
  void measureVoxels(const SparseVolume& volume, NanoValues values, TableRow& row) const;
  void measurePictures(Renderer& renderer, TableRow& row) const;
  void drawEsvr(const StoredGrid& grid, const SparseVolume& voxels, TableRow& row) const;
  [[nodiscard]] std::string command(const std::string& arguments) const;

  const TableScene& scene_;
  BaselineEncoder encoder_;
};

}  // namespace esvr::compare
