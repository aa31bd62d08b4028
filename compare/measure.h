#pragma once
/// Makes the rows of a table, one after the other, from the same voxels.

#include <functional>
#include <optional>
#include <string>

#include "compare/external_search.h"
#include "compare/table_options.h"
#include "compare/table_record.h"
#include "esvr/baseline.h"
#include "esvr/convert.h"
#include "esvr/device.h"

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

struct FitWish {
  std::optional<std::uint64_t> bytes{};  ///< size of the file; nothing: default options
  bool paper = false;                    ///< whether the paper's method is used, stored as float32
};

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

/// The name of a row: "NanoVDB FpN Zip", "ZFP accuracy".
[[nodiscard]] std::string displayName(const BaselineSetting& setting);

}  // namespace esvr::compare
