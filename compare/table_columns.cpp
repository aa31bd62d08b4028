#include "compare/table_columns.h"

#include "compare/figures.h"

namespace esvr::compare {
namespace {

using report::Cell;
using report::DataTable;
using report::Kind;

template <auto Member>
Cell metric(const TableRow& row, const TableRecord&) {
  return row.metrics ? Cell(double((*row.metrics).*Member)) : Cell();
}

template <auto Timing_, auto Member>
Cell seconds(const TableRow& row, const TableRecord&) {
  const auto& timing = row.*Timing_;
  return timing ? Cell(double((*timing).*Member)) : Cell();
}

Cell ratio(const TableRow& row, const TableRecord& record) {
  if (!row.bytes || !record.halfBlosc) return {};
  return double(*record.halfBlosc) / double(*row.bytes);
}

Cell ssim(const TableRow& row, const TableRecord&) {
  return row.metrics ? report::cellOf(row.metrics->ssim) : Cell();
}

template <auto Member>
Cell image(const TableRow& row, const TableRecord&) {
  return row.images ? Cell(double((*row.images).*Member)) : Cell();
}

Cell mass(const TableRow& row, const TableRecord&) {
  return row.metrics ? Cell(massError(*row.metrics)) : Cell();
}

Cell lpips(const TableRow& row, const TableRecord&) {
  return row.images ? report::cellOf(row.images->lpips) : Cell();
}

Cell countOf(const std::optional<std::uint64_t>& count) {
  return count ? Cell(double(*count)) : Cell();
}
Cell bytes(const TableRow& row, const TableRecord&) { return countOf(row.bytes); }
Cell memory(const TableRow& row, const TableRecord&) { return countOf(row.memory); }
Cell deviceMemory(const TableRow& row, const TableRecord&) {
  return row.images ? countOf(row.images->deviceBytes) : Cell();
}

}  // namespace

const std::vector<TableColumn>& tableColumns() {
  using R = TableRow;
  using T = TableRecord;
  using M = VolumeMetrics;
  constexpr Better kLess = Better::kLess, kMore = Better::kMore;
  static const std::vector<TableColumn> columns{
      {{"name", "row", Kind::kText, "the form in which the volume is stored"},
       [](const R& r, const T&) -> Cell { return r.name; }},
      {{"group", "group", Kind::kText}, [](const R& r, const T&) -> Cell { return r.group; }},
      {{"setting", "setting", Kind::kText}, [](const R& r, const T&) -> Cell { return r.setting; }},
      {{"bytes", "bytes", Kind::kBytes, "size of the file, bytes"}, bytes, kLess},
      {{"ratio", "ratio", Kind::kNumber, "size of the half-float Blosc VDB divided by this size"},
       ratio,
       kMore},
      {{"psnr_active", "active", Kind::kDecibels, "PSNR over the active voxels, dB"},
       metric<&M::psnrActive>,
       kMore},
      {{"psnr_box", "PSNR box", Kind::kDecibels, "PSNR over the box, dB"},
       metric<&M::psnrBox>,
       kMore},
      {{"max_error", "max err", Kind::kError, "largest error of a voxel, value units"},
       metric<&M::maxError>,
       kLess},
      {{"p999_error", "p99.9", Kind::kError,
        "error that 99.9 % of the voxels do not exceed, value units"},
       metric<&M::p999Error>,
       kLess},
      {{"ssim", "SSIM", Kind::kShare, "SSIM of the voxels"}, ssim, kMore},
      {{"iou", "IoU", Kind::kShare, "intersection over union of the active voxels"},
       metric<&M::iou>,
       kMore},
      {{"mass_error", "mass err", Kind::kError, "relative error of the sum of the values"},
       mass,
       kLess},
      {{"encode_s", "encode s", Kind::kSeconds, "time to encode, seconds"},
       seconds<&R::encode, &Timing::median>,
       kLess},
      {{"encode_min_s", "min", Kind::kSeconds, "shortest time to encode, seconds"},
       seconds<&R::encode, &Timing::min>},
      {{"encode_max_s", "max", Kind::kSeconds, "longest time to encode, seconds"},
       seconds<&R::encode, &Timing::max>},
      {{"decode_s", "decode s", Kind::kSeconds, "time to decode, seconds"},
       seconds<&R::decode, &Timing::median>,
       kLess},
      {{"decode_min_s", "min", Kind::kSeconds, "shortest time to decode, seconds"},
       seconds<&R::decode, &Timing::min>},
      {{"decode_max_s", "max", Kind::kSeconds, "longest time to decode, seconds"},
       seconds<&R::decode, &Timing::max>},
      {{"memory_bytes", "memory MB", Kind::kMegabytes, "memory of encoding and decoding, MB"},
       memory,
       kLess},
      {{"image_psnr", "image PSNR", Kind::kDecibels, "PSNR of the pictures, dB"},
       image<&ImageFigures::psnr>,
       kMore},
      {{"image_ssim", "image SSIM", Kind::kShare, "SSIM of the pictures"},
       image<&ImageFigures::ssim>,
       kMore},
      {{"flip", "FLIP", Kind::kShare, "FLIP of the pictures"}, image<&ImageFigures::flip>, kLess},
      {{"lpips", "LPIPS", Kind::kNumber, "LPIPS of the pictures"}, lpips, kLess},
      {{"fps", "FPS", Kind::kNumber, "pictures per second"},
       [](const R& r, const T&) { return report::cellOf(r.fps); },
       kMore},
      {{"device_bytes", "device MB", Kind::kMegabytes, "device memory that drawing held, MB"},
       deviceMemory,
       kLess},
      {{"note", "note", Kind::kText}, [](const R& r, const T&) -> Cell { return r.note; }},
      {{"command", "command", Kind::kText}, [](const R& r, const T&) -> Cell { return r.command; }},
  };
  return columns;
}

bool isBetter(const TableColumn& column, const Cell& cell, const Cell& than) {
  const auto *a = std::get_if<double>(&cell), *b = std::get_if<double>(&than);
  if (!a || !b || cellText(column.column, cell) == cellText(column.column, than)) return false;
  return column.better == Better::kLess ? *a < *b : column.better == Better::kMore && *a > *b;
}

bool isSize(const TableColumn& column) {
  return column.column.key == "bytes" || column.column.key == "ratio";
}

report::Row cellsOf(const TableRow& row, const TableRecord& record) {
  report::Row cells;
  for (const auto& column : tableColumns()) cells.push_back(column.of(row, record));
  return cells;
}

DataTable dataTable(const TableRecord& record, std::span<const TableRow> rows) {
  DataTable table;
  for (const auto& column : tableColumns()) table.columns.push_back(column.column);
  for (const auto& row : rows) table.rows.push_back(cellsOf(row, record));
  return table;
}

DataTable withoutEmptyColumns(const DataTable& table) {
  std::vector<std::string> keys;
  for (std::size_t c = 0; c < table.columns.size(); ++c)
    for (const auto& row : table.rows)
      if (!report::exactText(row[c]).empty()) {
        keys.push_back(table.columns[c].key);
        break;
      }
  return withColumns(table, keys);
}

}  // namespace esvr::compare
