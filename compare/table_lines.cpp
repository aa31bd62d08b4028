#include "compare/table_lines.h"

#include "cli/table.h"
#include "compare/finding.h"

namespace esvr::compare {

std::string sceneLine(const TableRecord& record) {
  return "grid \"" + record.grid + "\", " + std::to_string(record.activeVoxels) +
         " active voxels, box " + toString(record.box.min) + " to " + toString(record.box.max) +
         ", peak " + cli::shortNumber(record.peak);
}

std::string pictureLine(const TableRecord& record) {
  if (!record.referenceCost) return {};
  const ImageFigures& cost = *record.referenceCost;
  std::string text = "Pictures drawn on " + record.drawnOn + ", the reference's at " +
                     cli::shortNumber(cost.fps) + " pictures per second";
  if (cost.deviceBytes)
    text += ", as a NanoVDB float grid in " + cli::shortNumber(double(*cost.deviceBytes) / 1e6) +
            " MB of the device";
  return text + ".";
}

std::string rivalRule() {
  constexpr double kPercent = 100.0;
  return "The best rival is the row with the highest PSNR over the box among all rows that are not "
         "more than " +
         cli::shortNumber(kPercent * kSameSize) + " % larger than the file of ESVR.";
}

std::string interruption(const TableRecord& record) {
  return record.interrupted ? "Interrupted: rows are missing." : "";
}

}  // namespace esvr::compare
