#include "vdb2esvr/summary.h"

#include <ostream>

#include "cli/names.h"
#include "cli/printable.h"
#include "cli/table.h"

namespace esvr::vdb2esvr {

void printSummary(const Options& options, const RunRecord& record, std::ostream& out) {
  cli::Table table({"grid", "ellipsoids", "bytes", "PSNR box", "active", "max error", "seconds"});
  for (std::size_t g = 0; g < record.grids.size(); ++g) {
    const ConvertedGrid& grid = record.grids[g];
    table.add({grid.uniqueName, std::to_string(grid.stored().field.ellipsoidCount()),
               std::to_string(cli::storedBytes(record.output, g)),
               cli::decibels(grid.metrics.psnrBox), cli::decibels(grid.metrics.psnrActive),
               cli::shortNumber(grid.metrics.maxError), cli::seconds(grid.seconds.total())});
  }
  table.print(out);
  const Ratio ratio = ratioOf(record);
  out << cli::printable(options.input.string());
  if (!ratio.wholeInput()) out << ", " << ratio.grids << " of " << ratio.gridsOfInput << " grids:";
  out << ' ' << ratio.bytesIn << " bytes -> " << cli::printable(options.output.string()) << ' '
      << ratio.bytesOut << " bytes, 1 : " << cli::shortNumber(ratio.value()) << '\n';
}

}  // namespace esvr::vdb2esvr
