#include "vdb2esvr/summary.h"

#include <algorithm>
#include <cmath>
#include <ostream>

#include "cli/names.h"
#include "cli/printable.h"
#include "cli/shell_word.h"
#include "cli/table.h"

namespace esvr::vdb2esvr {
namespace {

std::string toText(const Candidate& candidate) {
  std::string text = candidate.estimated ? "about " : "";
  text += std::to_string(candidate.bytes) + " bytes";
  if (!candidate.psnr) return text;
  if (std::isinf(*candidate.psnr)) return text + ", exact";
  return text + ", " + cli::decibels(*candidate.psnr) + " dB";
}

/// Says which representation was chosen for a grid, and why.
void printChoice(const ConvertedGrid& grid, std::ostream& out) {
  const auto& choice = grid.conversion.choice;
  if (!choice || !choice->voxels || !choice->ellipsoids) return;
  const bool voxels = grid.stored().voxels.has_value();
  const Candidate& taken = voxels ? *choice->voxels : *choice->ellipsoids;
  const Candidate& other = voxels ? *choice->ellipsoids : *choice->voxels;
  out << cli::printable(grid.uniqueName) << (voxels ? ": voxels (" : ": ellipsoids (")
      << toText(taken) << ") rather than " << (voxels ? "ellipsoids (" : "voxels (")
      << toText(other) << ')';
  if (voxels && other.estimated && other.bytes < taken.bytes)
    out << ", which may save too little for a longer fit";
  out << '\n';
}

/// Says that the overlap of active voxels was given up for a size or for the memory.
void printOverlap(const Options& options, const ConvertedGrid& grid, std::ostream& out) {
  const bool isBand = grid.stored().topology == TopologyKind::kBricks;
  if (options.convert.storage.activity != Activity::kAuto || isBand) return;
  if (grid.metrics.iou > kMinOverlap) return;
  out << cli::printable(grid.uniqueName)
      << ": a mask of active voxels would take too much of the size or of the memory; their "
         "overlap is "
      << cli::shortNumber(grid.metrics.iou) << '\n';
}

/// Says what the mask of active voxels or the thresholds of blocks take, if there are any.
void printTopology(const RunRecord& record, std::size_t g, std::ostream& out) {
  const ConvertedGrid& grid = record.grids[g];
  const TopologyKind kind = grid.stored().topology;
  const bool isMask = kind == TopologyKind::kMask;
  if (grid.stored().voxels || !(isMask || kind == TopologyKind::kBlocks)) return;
  out << cli::printable(grid.uniqueName) << ": "
      << (!isMask                  ? "thresholds of blocks take "
          : grid.metrics.iou < 1.0 ? "a simplified mask of active voxels takes "
                                   : "the mask of active voxels takes ")
      << bytesOf(record.output, g, isMask ? "mask" : "levels") << " bytes, with an overlap of "
      << cli::shortNumber(grid.metrics.iou) << '\n';
}

/// Says that ellipsoids, on which the user insisted, take more bytes than exact voxels.
void printRemark(const ConvertedGrid& grid, std::ostream& out) {
  if (const auto bytes = grid.conversion.smallerExactBytes)
    out << cli::printable(grid.uniqueName) << ": exact voxels would take fewer bytes, about "
        << *bytes << '\n';
}

/// Says how far the surface of a level set has moved, or why the grid is stored like other grids.
void printSurface(const ConvertedGrid& grid, std::ostream& out) {
  if (!grid.whyNoNarrowBand.empty())
    out << cli::printable(grid.uniqueName)
        << ": this level set is stored like other grids, because " << grid.whyNoNarrowBand << '\n';
  if (!grid.surface || !grid.surface->distance) return;
  out << cli::printable(grid.uniqueName) << ": the surface moves by at most "
      << cli::shortNumber(grid.surface->distance->voxels) << " voxels, and "
      << grid.surface->signs.voxels << " voxels change sign\n";
}

/// Says which values of inactive voxels the file does not hold, and how to keep them.
void printInactive(const RunRecord& record, const ConvertedGrid& grid, std::ostream& out) {
  if (grid.inactive.count() == 0) return;
  out << cli::printable(grid.uniqueName) << ": gives up " << toText(grid.inactive);
  const auto source =
      std::ranges::find(record.input.grids, grid.sourceName, &GridSummary::uniqueName);
  if (source != record.input.grids.end() && source->whyNotCarried.empty())
    out << "; --lossless or --keep " << cli::printable(cli::shellWord(grid.sourceName))
        << " keeps them";
  out << '\n';
}

/// Says how the data of a grid were made.
void printNote(const ConvertedGrid& grid, std::ostream& out) {
  printSurface(grid, out);
  if (!grid.twinOf) {
    printRemark(grid, out);
    return printChoice(grid, out);
  }
  out << cli::printable(grid.uniqueName) << ": stored once with " << cli::printable(grid.sameAs)
      << ", which has the same voxels\n";
}

/// Says which grids the voxels of others refer to, and what that saved.
void printShared(const RunRecord& record, std::ostream& out) {
  for (const ConvertedGrid& grid : record.grids)
    if (grid.shared && !grid.shared->with.empty() && !grid.twinOf)
      out << cli::printable(grid.uniqueName) << ": refers to " << cli::printable(grid.shared->with)
          << ", with " << grid.shared->bytesWith << " bytes rather than "
          << grid.shared->bytesWithout << '\n';
  if (record.bytesSeparate > record.output.fileBytes)
    out << "Sharing between grids made the file " << record.bytesSeparate - record.output.fileBytes
        << " bytes smaller ("
        << cli::shortNumber(double(record.bytesSeparate) / double(record.output.fileBytes))
        << " times)\n";
}

void printFitted(const Options& options, const RunRecord& record, std::ostream& out) {
  if (record.grids.empty()) return;
  cli::Table table(
      {"grid", "ellipsoids", "bytes", "PSNR active", "PSNR box", "max error", "seconds"});
  for (std::size_t g = 0; g < record.grids.size(); ++g) {
    const ConvertedGrid& grid = record.grids[g];
    table.add({grid.uniqueName, std::to_string(grid.stored().field.ellipsoidCount()),
               std::to_string(cli::ownBytes(record.output, g)),
               cli::decibels(grid.metrics.psnrActive), cli::decibels(grid.metrics.psnrBox),
               cli::shortNumber(grid.metrics.maxError), cli::seconds(grid.seconds.total())});
  }
  table.print(out);
  for (std::size_t g = 0; g < record.grids.size(); ++g) {
    if (!record.grids[g].twinOf) {
      printTopology(record, g, out);
      printOverlap(options, record.grids[g], out);
    }
    printInactive(record, record.grids[g], out);
    printNote(record.grids[g], out);
  }
}

/// Lists the errors of the vectors. The table of fitted grids has their components.
void printVectors(const RunRecord& record, std::ostream& out) {
  if (record.vectors.empty()) return;
  cli::Table table({"vectors", "values", "bytes", "PSNR active", "PSNR box", "max error"});
  for (const ConvertedVector& vector : record.vectors) {
    if (!vector.metrics) continue;  // the run was interrupted
    const VolumeMetrics& m = vector.metrics->magnitude;
    table.add({vector.uniqueName, vector.valueType, std::to_string(ownBytes(record.output, vector)),
               cli::decibels(m.psnrActive), cli::decibels(m.psnrBox),
               cli::shortNumber(m.maxError)});
  }
  table.print(out);
}

/// Lists the grids that the file holds unchanged, and those that it does not hold.
void printNotFitted(const RunRecord& record, std::ostream& out) {
  cli::Table table({"carried", "values", "bytes", "bytes in source"});
  for (std::size_t c = 0; c < record.carried.size(); ++c) {
    const GridSummary& grid = record.carried[c].grid;
    table.add({grid.uniqueName, grid.valueType,
               std::to_string(cli::ownBytes(record.output, numberOfCarried(record, c))),
               std::to_string(grid.storedBytes)});
  }
  if (!record.carried.empty()) table.print(out);
  for (const auto& [grid, place, why] : record.carried)
    out << cli::printable(grid.uniqueName) << ": carried unchanged, because " << cli::printable(why)
        << '\n';
  for (const auto& [grid, place, why] : record.skipped)
    out << cli::printable(grid.uniqueName) << ": left out, because " << cli::printable(why) << '\n';
}

}  // namespace

void printSummary(const Options& options, const RunRecord& record, std::ostream& out) {
  printFitted(options, record, out);
  printVectors(record, out);
  printNotFitted(record, out);
  printShared(record, out);
  const Ratio ratio = ratioOf(record);
  out << cli::printable(options.input.string());
  if (!ratio.wholeInput()) out << ", " << ratio.grids << " of " << ratio.gridsOfInput << " grids:";
  out << ' ' << ratio.bytesIn << " bytes -> " << cli::printable(options.output.string()) << ' '
      << ratio.bytesOut << " bytes, 1 : " << cli::shortNumber(ratio.value()) << '\n';
}

}  // namespace esvr::vdb2esvr
