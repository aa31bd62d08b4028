#include "compare/curves_points.h"

#include <algorithm>

namespace esvr::compare {
namespace {

using report::Cell;
using report::Kind;

/// The curve of a row: rows of the same name form a curve, and all rows of ESVR form one.
std::string seriesOf(const TableRow& row) { return row.group == kOurGroup ? kOurGroup : row.name; }

}  // namespace

std::map<std::string, std::vector<const TableRow*>> rowsBySeries(const TableRecord& record) {
  std::map<std::string, std::vector<const TableRow*>> series;
  for (const auto& row : record.rows)
    if (row.bytes && row.metrics) series[seriesOf(row)].push_back(&row);
  for (auto& [name, rows] : series)
    std::sort(rows.begin(), rows.end(),
              [](const TableRow* a, const TableRow* b) { return *a->bytes < *b->bytes; });
  return series;
}

report::DataTable curvePoints(const TableRecord& record) {
  report::DataTable table{
      {},
      {{"kind", "kind", Kind::kText},
       {"series", "series", Kind::kText},
       {"name", "name", Kind::kText},
       {"bytes", "bytes", Kind::kBytes, "size of the file, bytes"},
       {"seconds", "seconds", Kind::kSeconds},
       {"psnr_box", "PSNR box", Kind::kDecibels, "PSNR over the box, dB"},
       {"psnr_active", "active", Kind::kDecibels, "PSNR over the active voxels, dB"},
       {"max_error", "max error", Kind::kNumber, "largest error of a voxel, value units"},
       {"fps", "FPS", Kind::kNumber, "pictures per second"},
       {"setting", "setting", Kind::kText}},
      {}};
  for (const auto& [series, rows] : rowsBySeries(record))
    for (const TableRow* row : rows) {
      for (const auto& at : row->curve)
        table.rows.push_back({std::string(kFitPoint), series, row->name, double(*row->bytes),
                              at.seconds, at.psnrBox, at.psnrActive, at.maxError, Cell(), Cell()});
      const auto seconds = row->encode ? std::optional(row->encode->median) : std::nullopt;
      table.rows.push_back({std::string(kFilePoint), series, row->name, double(*row->bytes),
                            report::cellOf(seconds), row->metrics->psnrBox,
                            row->metrics->psnrActive, row->metrics->maxError,
                            report::cellOf(row->fps), row->setting});
    }
  return table;
}

}  // namespace esvr::compare
