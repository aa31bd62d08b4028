#pragma once
/// Makes the rows of a table, one after the other, all of them from the same voxels.

#include <functional>
#include <optional>
#include <string>

#include "compare/table_options.h"
#include "compare/table_record.h"
#include "esvr/baseline.h"
#include "esvr/convert.h"
#include "esvr/device.h"

namespace esvr::compare {

/// The reference, and what every row shares.
struct TableScene {
  const TableOptions& options;
  std::string gridName;  ///< unique name in the reference
  const VolumeGrid& reference;
  std::vector<MetaItem> metadata;  ///< the reference file's
  Box box;
  double peak = 1.0;
  std::filesystem::path folder;  ///< for files that come and go
  const CancelToken& cancel;
  const Gallery* gallery = nullptr;  ///< null: no pictures
};

/// How an .esvr is drawn, in esvr-render's words.
enum class Drawing {
  kEllipsoids,  ///< its ellipsoids, where they say all: not of a narrow band or a stored mask
  kBricks       ///< the voxels that it decodes to
};

struct FitWish {
  std::optional<std::uint64_t> bytes{};  ///< of the file; nothing: whatever the defaults take
  bool paper = false;                    ///< by the paper's method, stored as float32
};

class RowMaker {
 public:
  explicit RowMaker(const TableScene& scene);

  /// Each leaves its reason in the row's note where it cannot be made; \throws Cancelled.
  TableRow baseline(const std::string& group, const BaselineSetting& setting,
                    const std::string& name);
  /// The best setting of `like`'s form for a size or a PSNR.
  TableRow sizeMatched(const BaselineSetting& like, std::uint64_t bytes);
  TableRow psnrMatched(const BaselineSetting& like, double psnr);
  TableRow external(const External& external);
  /// \throws BadInput  a candidate that cannot be compared: no such grid, nothing in common
  TableRow candidate(const std::filesystem::path& path, Drawing drawing = Drawing::kEllipsoids);
  /// Ellipsoids fitted here.
  TableRow fitted(const FitWish& wish);

 private:
  void measure(const BaselineSetting& setting, TableRow& row);
  TableRow matched(const BaselineSetting& like, const std::string& group,
                   const std::function<Match()>& search);
  /// \param head  bytes of a file without grids
  [[nodiscard]] Conversion convert(const FitWish& wish, std::uint64_t head) const;
  void measureEsvr(const std::filesystem::path& path, Drawing drawing, TableRow& row);
  [[nodiscard]] VolumeMetrics compare(const SparseVolume& volume) const;
  /// Figures of the voxels and, where pictures were asked for, of what they look like.
  void measureVoxels(const SparseVolume& volume, NanoValues values, TableRow& row) const;
  void measurePictures(Renderer& renderer, const OwnView& own, TableRow& row) const;
  void drawEsvr(const StoredGrid& grid, const SparseVolume& voxels, Drawing drawing,
                TableRow& row) const;
  [[nodiscard]] std::string command(const std::string& arguments) const;

  const TableScene& scene_;
  BaselineEncoder encoder_;
};

/// "NanoVDB FpN Zip", "ZFP accuracy".
[[nodiscard]] std::string displayName(const BaselineSetting& setting);

}  // namespace esvr::compare
