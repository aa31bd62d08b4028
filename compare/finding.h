#pragma once
/// What a table or curves have found: ESVR beside its best rivals.

#include <string>
#include <vector>

#include "compare/table_record.h"

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

}  // namespace esvr::compare
