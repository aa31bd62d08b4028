#include "compare/page_order.h"

#include <algorithm>

#include "report/units.h"

namespace esvr::compare {

using report::Emphasis;

PageOrder::PageOrder(const TableRecord& record) : record_(record), duels_(duelsOf(record)) {
  for (const auto& duel : duels_) addSize(*duel.ours);
  for (const auto& row : record.rows)
    addUnplaced(row, {row.group, {}, row.matchedBytes.has_value()});
}

Emphasis PageOrder::emphasisOf(const TableRow& row) const {
  if (row.group == kOurGroup) return Emphasis::kOurs;
  const auto isRival = [&](const Duel& duel) { return duel.rival == &row; };
  return std::any_of(duels_.begin(), duels_.end(), isRival) ? Emphasis::kRival : Emphasis::kNone;
}

/// Adds a row of ESVR, the rows of its size and those of its PSNR.
void PageOrder::addSize(const TableRow& ours) {
  const std::string size = "at most " + std::to_string(*ours.bytes) + " bytes (" +
                           report::bytesText(double(*ours.bytes)) + ")";
  addUnplaced(ours, {size, {}, true});
  for (const auto& row : record_.rows)
    if (row.matchedBytes == ours.bytes) addUnplaced(row, {size, {}, true});
  for (const auto& row : record_.rows)
    if (row.matchedPsnr == ours.metrics->psnrBox) addUnplaced(row, {row.group, {}, false});
}

/// Adds a row to the group of this heading if no group has the row yet.
void PageOrder::addUnplaced(const TableRow& row, RowGroup group) {
  const auto hasRow = [&](const RowGroup& other) {
    return std::count(other.rows.begin(), other.rows.end(), &row) != 0;
  };
  if (std::any_of(groups_.begin(), groups_.end(), hasRow)) return;
  const auto isIt = [&](const RowGroup& other) { return other.heading == group.heading; };
  auto place = std::find_if(groups_.begin(), groups_.end(), isIt);
  if (place == groups_.end()) place = groups_.insert(place, std::move(group));
  place->rows.push_back(&row);
}

}  // namespace esvr::compare
