#pragma once
/// What a table or curves have found: ESVR beside its best rivals, and the order of the rows on a
/// page that shows it.

#include <string>
#include <vector>

#include "compare/table_record.h"
#include "programs/page_figures.h"

namespace esvr::compare {

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

}  // namespace esvr::compare
