#include "compare/table_record.h"

#include <algorithm>

#include "esvr/error.h"

namespace esvr::compare {

Timing timingOf(std::vector<double> seconds) {
  std::sort(seconds.begin(), seconds.end());
  const std::size_t n = seconds.size();
  return {(seconds[(n - 1) / 2] + seconds[n / 2]) / 2, seconds.front(), seconds.back(), int(n)};
}

void requireAllRows(const TableRecord& record) {
  if (record.interrupted)
    throw RuntimeFailure("interrupted; " + std::to_string(record.rows.size()) +
                         " rows were made, the others are missing");
}

}  // namespace esvr::compare
