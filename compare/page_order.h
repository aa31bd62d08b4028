#pragma once
/// The order of the rows on a page, and which of them stand out.

#include <string>
#include <vector>

#include "compare/finding.h"
#include "compare/table_record.h"
#include "report/emphasis.h"

namespace esvr::compare {

struct RowGroup {
  std::string heading;
  std::vector<const TableRow*> rows;
  bool ofOneSize = false;  ///< whether the rows were searched for one size
};

/// Each row of ESVR, the rows of its size and those of its PSNR come first. The other groups follow
/// in their order.
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
