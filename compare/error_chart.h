#pragma once
/// Charts of errors: the root mean square error over the box as a share of the peak, with PSNR as a
/// second scale.

#include <string>

#include "compare/table_record.h"
#include "report/chart.h"

namespace esvr::compare {

/// A chart of errors on logarithmic axes, without series. \param title  its title
[[nodiscard]] report::Chart errorOverBytes(const std::string& title);
[[nodiscard]] report::Chart errorOverSeconds(const std::string& title);

/// A point of such a chart. Where there is no error, the point is not shown.
/// \param x     bytes or seconds
/// \param psnr  dB over the box
/// \param note  what to say about the point besides its values
[[nodiscard]] report::Point errorPoint(double x, double psnr, const std::string& note = {});

/// The families of all rows (ESVR, OpenVDB, NanoVDB, ZFP, ...) over the size of their files.
[[nodiscard]] report::Chart familiesOverBytes(const TableRecord& record);

}  // namespace esvr::compare
