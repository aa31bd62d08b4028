#include <iostream>

#include "cli/printable.h"
#include "cli/table.h"
#include "esvr/sequence_file.h"
#include "esvr2vdb/jobs.h"

namespace esvr::esvr2vdb {
namespace {

std::vector<std::string> rowOf(const SequenceFrame& frame) {
  return {std::to_string(frame.number), std::to_string(frame.group), std::to_string(frame.bytes),
          frame.dependsOnPrevious ? "frame before" : "-"};
}

}  // namespace

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
