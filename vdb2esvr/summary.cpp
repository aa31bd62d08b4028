// The tables that a run and a sequence print.
#include "vdb2esvr/records.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <ostream>
#include <utility>

#include "programs/option_values.h"
#include "programs/run_main.h"
#include "vdb2esvr/run.h"

namespace esvr::vdb2esvr {

// A run.

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
  if (grid.conversion.fitsTookTooLong)
    out << cli::printable(grid.uniqueName)
        << ": voxels, because fitting ellipsoids would take too long; a higher --effort or "
           "--representation ellipsoids fits them\n";
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

/// Says what the mask of active voxels takes, if there is one.
void printTopology(const RunRecord& record, std::size_t g, std::ostream& out) {
  const ConvertedGrid& grid = record.grids[g];
  if (grid.stored().voxels || grid.stored().topology != TopologyKind::kMask) return;
  out << cli::printable(grid.uniqueName) << ": the mask of active voxels takes "
      << bytesOf(record.output, g, "mask") << " bytes\n";
}

/// Says that ellipsoids, on which the user insisted, take more bytes than exact voxels.
void printRemark(const ConvertedGrid& grid, std::ostream& out) {
  if (const auto bytes = grid.conversion.smallerExactBytes)
    out << cli::printable(grid.uniqueName) << ": exact voxels would take fewer bytes, about "
        << *bytes << '\n';
}

/// Says how far the surface of a level set has moved, or why the grid is stored like other grids.
void printSurface(const ConvertedGrid& grid, std::ostream& out) {
  if (!grid.whyNoNarrowBand.empty() && !grid.conversion.surfaceBound)
    out << cli::printable(grid.uniqueName)
        << ": this level set is stored like other grids, because " << grid.whyNoNarrowBand << '\n';
  if (!grid.surface || !grid.surface->distance) return;
  out << cli::printable(grid.uniqueName) << ": the surface moves by at most "
      << cli::shortNumber(grid.surface->distance->voxels) << " voxels, and "
      << cli::counted(grid.surface->signs.voxels, "voxel")
      << (grid.surface->signs.voxels == 1 ? " changes sign\n" : " change sign\n");
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

/// Says that a grid loses doubles whose range is small beside their magnitude.
void printNarrowing(const ConvertedGrid& grid, std::ostream& out) {
  constexpr double kMuch = 0.001;
  if (grid.narrowingOfRange < kMuch) return;
  out << cli::printable(grid.uniqueName) << ": its doubles become floats, which differ by up to "
      << cli::shortNumber(100.0 * grid.narrowingOfRange) << " % of their range; --keep "
      << cli::printable(cli::shellWord(grid.sourceName)) << " keeps them\n";
}

/// Says that the goal was measured by what is seen, and which tone curve serves it, or by the surface.
void printMeasure(const ConvertedGrid& grid, std::ostream& out) {
  if (const auto bound = grid.conversion.surfaceBound)
    out << cli::printable(grid.uniqueName)
        << ": judged by its surface; every active value is within " << cli::shortNumber(*bound)
        << ", and no active voxel changes its side\n";
  const ToneCurve tone = grid.stored().tone;
  if (!grid.conversion.byPictures && !tone.isOn()) return;
  out << cli::printable(grid.uniqueName) << ": ";
  if (grid.conversion.byPictures) out << "judged by what is seen of it (PSNR T 0.5)";
  if (grid.conversion.byPictures && tone.isOn()) out << ", with ";
  if (tone.isOn()) out << "a tone curve of scale " << cli::shortNumber(tone.scale);
  out << '\n';
}

/// Says how the data of a grid were made.
void printNote(const ConvertedGrid& grid, std::ostream& out) {
  printNarrowing(grid, out);
  printMeasure(grid, out);
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
    if (grid.shared && !grid.sharesWith.empty() && !grid.twinOf)
      out << cli::printable(grid.uniqueName) << ": refers to " << cli::printable(grid.sharesWith)
          << ", with " << grid.shared->bytesWith << " bytes rather than "
          << grid.shared->bytesWithout << '\n';
  if (record.bytesSeparate > record.output.fileBytes)
    out << "Sharing between grids made the file " << record.bytesSeparate - record.output.fileBytes
        << " bytes smaller ("
        << cli::shortNumber(double(record.bytesSeparate) / double(record.output.fileBytes))
        << " times)\n";
}

void printFitted(const RunRecord& record, std::ostream& out) {
  if (record.grids.empty()) return;
  cli::Table table({"grid", "ellipsoids", "bytes", "PSNR active", "PSNR box", "PSNR T 0.5",
                    "max error", "seconds"});
  for (std::size_t g = 0; g < record.grids.size(); ++g) {
    const ConvertedGrid& grid = record.grids[g];
    const auto& light = grid.metrics.transmittance;
    table.add({grid.uniqueName, std::to_string(grid.stored().field.ellipsoidCount()),
               std::to_string(cli::ownBytes(record.output, g)),
               cli::decibels(grid.metrics.psnrActive), cli::decibels(grid.metrics.psnrBox),
               light ? cli::decibels(light->psnr50) : "-", cli::shortNumber(grid.metrics.maxError),
               cli::seconds(grid.seconds.total())});
  }
  table.print(out);
  for (std::size_t g = 0; g < record.grids.size(); ++g) {
    if (!record.grids[g].twinOf) printTopology(record, g, out);
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
               record.isOfSplats ? "-" : std::to_string(grid.storedBytes)});
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
  printFitted(record, out);
  printVectors(record, out);
  printNotFitted(record, out);
  printShared(record, out);
  const Ratio ratio = ratioOf(record);
  out << cli::printable(options.namedInput().string());
  if (!ratio.wholeInput() && !record.isOfSplats)
    out << ", " << ratio.grids << " of " << ratio.gridsOfInput << " grids:";
  out << ' ' << ratio.bytesIn << " bytes -> " << cli::printable(options.output.string()) << ' '
      << ratio.bytesOut << " bytes, 1 : " << cli::shortNumber(ratio.value()) << '\n';
}

// A sequence.

namespace {

std::string stateOf(const SequenceRecord& record, const FrameRecord& frame) {
  if (frame.state != FrameState::kHeld) return nameOf(frame.state);
  return "held from " + std::to_string(record.frames[*frame.frame.holds].frame.number);
}

/// True for a frame that this run converted, which may have no grid.
bool hasFigures(const FrameRecord& frame) { return frame.bytesIn > 0; }

/// The smallest value of the fitted grids of a frame as text.
std::string lowest(const FrameRecord& frame, double FrameGrid::*psnr) {
  if (frame.grids.empty()) return "-";
  double least = std::numeric_limits<double>::infinity();
  for (const FrameGrid& grid : frame.grids) least = std::min(least, grid.*psnr);
  return cli::decibels(least);
}

/// The same of the PSNR of transmittance, which only grids that are looked through have.
std::string lowestT50(const FrameRecord& frame) {
  std::optional<double> least;
  for (const FrameGrid& grid : frame.grids)
    if (grid.psnrT50) least = std::min(least.value_or(*grid.psnrT50), *grid.psnrT50);
  return least ? cli::decibels(*least) : "-";
}

std::vector<std::string> rowOf(const SequenceRecord& record, const FrameRecord& frame) {
  const std::string number = std::to_string(frame.frame.number);
  const std::string state = stateOf(record, frame);
  if (!hasFigures(frame)) return {number, "-", "-", "-", "-", "-", "-", "-", "-", state};
  std::size_t ellipsoids = 0;
  for (const FrameGrid& grid : frame.grids) ellipsoids += grid.ellipsoids;
  return {number,
          std::to_string(frame.grids.size()),
          std::to_string(frame.carried.size()),
          std::to_string(ellipsoids),
          std::to_string(frame.bytesOut),
          lowest(frame, &FrameGrid::psnrActive),
          lowest(frame, &FrameGrid::psnrBox),
          lowestT50(frame),
          cli::seconds(frame.seconds),
          state};
}

/// "40.01 to 40.04 dB", or "exact".
std::string rangeText(const GridRange& range) {
  const std::string low = cli::decibels(range.lowestActive);
  const std::string high = cli::decibels(range.highestActive);
  if (std::isinf(range.lowestActive)) return low;
  return (low == high ? low : low + " to " + high) + " dB";
}

void printRanges(const SequenceRecord& record, std::ostream& out) {
  for (const GridRange& range : gridRanges(record))
    out << cli::printable(range.name) << ": " << rangeText(range) << " over the active voxels of "
        << cli::counted(range.frames, "frame") << '\n';
}

/// Says what became of grids that were not fitted, each once with the number of its frames.
void printNotFittedIn(const SequenceRecord& record, std::vector<NotFittedName> FrameRecord::*grids,
                      const char* what, std::ostream& out) {
  std::map<std::pair<std::string, std::string>, std::size_t> counts;
  for (const FrameRecord& frame : record.frames)
    for (const NotFittedName& grid : frame.*grids) ++counts[{grid.name, grid.why}];
  for (const auto& [grid, frames] : counts)
    out << cli::printable(grid.first) << ": " << what << " in " << cli::counted(frames, "frame")
        << ", because " << cli::printable(grid.second) << '\n';
}

/// Says how the frames are divided into the groups of one file.
void printGroups(const Options& options, const SequenceRecord& record, std::ostream& out) {
  if (!record.file) return;
  std::vector<cli::FrameNumber> differing;
  for (const FrameRecord& frame : record.frames)
    if (frame.gridsDiffer) differing.push_back(frame.frame.number);
  out << cli::printable(options.output.string()) << ": "
      << cli::counted(record.file->groups, "group") << " of at most " << kGroupFrames
      << " frames\n";
  if (!differing.empty())
    out << (differing.size() == 1 ? "frame " : "frames ") << cli::textOfFrames(differing)
        << (differing.size() == 1 ? " begins a group, because its"
                                  : " each begin a group, because their")
        << " grids differ from those of the frame before\n";
}

/// The bytes of the output of the frames that this run converted.
std::uint64_t bytesOutOf(const SequenceRecord& record) {
  if (record.file) return record.file->bytes.value_or(0);
  std::uint64_t bytes = 0;
  for (const FrameRecord& frame : record.frames) bytes += hasFigures(frame) ? frame.bytesOut : 0;
  return bytes;
}

void printBytes(const Options& options, const SequenceRecord& record, std::ostream& out) {
  std::uint64_t bytesIn = 0;
  for (const FrameRecord& frame : record.frames) bytesIn += frame.bytesIn;
  const std::uint64_t bytesOut = bytesOutOf(record);
  const bool hasKept = !framesIn(FrameState::kKept, record).empty();
  // The file has the frames of an earlier run, too, whose input this run did not read.
  if (bytesOut == 0 || (record.file && hasKept)) return;
  out << cli::printable(options.namedInput().string()) << ' ' << bytesIn << " bytes -> "
      << cli::printable(options.output.string()) << ' ' << bytesOut
      << " bytes, 1 : " << cli::shortNumber(double(bytesIn) / double(bytesOut)) << '\n';
}

}  // namespace

void printSequence(const Options& options, const SequenceRecord& record, std::ostream& out) {
  cli::Table table({"frame", "fitted", "carried", "ellipsoids", "bytes", "PSNR active", "PSNR box",
                    "PSNR T 0.5", "seconds", "state"});
  for (const FrameRecord& frame : record.frames) table.add(rowOf(record, frame));
  table.print(out);
  printRanges(record, out);
  printNotFittedIn(record, &FrameRecord::carried, "carried unchanged", out);
  printNotFittedIn(record, &FrameRecord::skipped, "left out", out);
  printGroups(options, record, out);
  printBytes(options, record, out);
}

}  // namespace esvr::vdb2esvr
