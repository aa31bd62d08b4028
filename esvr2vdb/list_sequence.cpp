#include <filesystem>
#include <iostream>
#include <optional>

#include "cli/frame_messages.h"
#include "cli/printable.h"
#include "cli/table.h"
#include "esvr/error.h"
#include "esvr/sequence_file.h"
#include "esvr/vdb_io.h"
#include "esvr2vdb/choose_grids.h"
#include "esvr2vdb/jobs.h"

namespace esvr::esvr2vdb {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> rowOf(const SequenceFrame& frame) {
  return {std::to_string(frame.number), std::to_string(frame.group), std::to_string(frame.bytes),
          frame.dependsOnPrevious ? "frame before" : "-"};
}

/// The names of the grids of a file; "-" if it has none.
std::string gridsIn(const fs::path& path, const Options& options) {
  std::vector<std::string> names;
  if (path.extension() == ".esvr") {
    // The grids' records suffice, so that nothing is decoded.
    ReadPart wanted{.limits = limitsOf(options)};
    wanted.grids.emplace();
    for (const ListedGrid& grid : listedGrids(readEsvrPart(path, wanted).file))
      names.push_back(grid.name);
  } else {
    for (const GridSummary& grid : inspectVdb(path).grids) names.push_back(grid.uniqueName);
  }
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text.empty() ? "-" : text;
}

}  // namespace

void listFrames(const Options& options, const cli::FramePattern& pattern) {
  const cli::Log log(kProgram, options.verbosity);
  const cli::FrameListing listing = cli::framesOnDisk(pattern);
  cli::Table table({"frame", "bytes", "grids"});
  std::vector<cli::FrameNumber> failed;
  std::optional<Error> first;
  for (const cli::FrameNumber frame : listing.frames) {
    const fs::path path = pattern.toRead(frame);
    try {
      std::string grids = gridsIn(path, options);
      table.add({std::to_string(frame), std::to_string(fs::file_size(path)), std::move(grids)});
    } catch (const Error& error) {
      log.error("frame " + std::to_string(frame) + ": " + error.what());
      if (!first) first = error;
      failed.push_back(frame);
    }
  }
  std::cout << cli::printable(pattern.text()) << ": " << listing.frames.size()
            << " frames, a file each\n\n";
  table.print(std::cout);
  if (const std::string hint = listing.hint(); !hint.empty())
    log.warning(pattern.text() + ": " + hint);
  if (first) throw Error(first->kind(), cli::sentenceOn(failed, listing.frames.size(), "failed"));
}

void listSequence(const Options& options) {
  const SequenceReader reader(options.input);
  const EsvrSummary summary = inspectEsvr(options.input);
  std::cout << cli::printable(options.input.string()) << ": .esvr format " << summary.versionMajor
            << '.' << summary.versionMinor << ", " << summary.fileBytes << " bytes, "
            << reader.frames().size() << " frames in " << reader.groupCount() << " groups\n\n";
  cli::Table table({"frame", "group", "bytes", "refers to"});
  for (const SequenceFrame& frame : reader.frames()) table.add(rowOf(frame));
  table.print(std::cout);
}

}  // namespace esvr::esvr2vdb
