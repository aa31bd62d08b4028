#include "compare/stability.h"

#include <algorithm>
#include <iostream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "cli/frame_messages.h"
#include "cli/interrupts.h"
#include "cli/json_file.h"
#include "cli/output.h"
#include "cli/thread_limit.h"
#include "compare/frame_source.h"
#include "compare/measure_stability.h"
#include "compare/program.h"
#include "compare/stability_report.h"
#include "esvr/error.h"

namespace esvr::compare {
namespace {

void checkFiles(const StabilityRequest& request) {
  if (request.report.empty() || request.report == cli::kStandardOutput) return;
  cli::requireSeparate(cli::filesOfInput(request.file.string()), {request.report});
  cli::checkOutput(request.report, {".json"}, request.overwrite);
}

/// The CPU, which users decode on, and the GPU that is asked for or usable.
std::vector<Device> devicesOf(const std::string& option) {
  std::vector<Device> devices{Device{}};
  const Device device = selectDevice(option);
  if (device.kind != DeviceKind::kCpu) devices.push_back(device);
  return devices;
}

/// The frames of a sequence that are measured. \throws BadInput  one is missing
std::vector<cli::FrameNumber> framesOf(const StabilityRequest& request, const FrameSource& source) {
  if (!request.frames) return source.numbers();
  std::vector<cli::FrameNumber> missing;
  std::ranges::copy_if(*request.frames, std::back_inserter(missing), [&](cli::FrameNumber frame) {
    return !std::ranges::binary_search(source.numbers(), frame);
  });
  if (!missing.empty())
    throw BadInput(
        cli::sentenceOn(missing, request.frames->size(), "are not in " + request.file.string()));
  return *request.frames;
}

void append(cli::FrameNumber frame, std::vector<GridStability> grids, StabilityRecord& record) {
  for (GridStability& grid : grids) {
    grid.frame = frame;
    grid.name = "frame " + std::to_string(frame) + ": " + grid.name;
    record.grids.push_back(std::move(grid));
  }
}

StabilityRecord measured(const StabilityRun& run) {
  StabilityRecord record;
  const StabilityRequest& request = run.request;
  const auto source = FrameSource::in(request.file.string(), request.memory);
  if (!source && request.frames) throw UsageError("--frames needs a sequence");
  const cli::Log log(kProgram, request.verbosity);
  const std::string hint =
      source ? source->hint(request.frames ? &*request.frames : nullptr) : std::string();
  if (!hint.empty()) log.warning(hint);
  if (!source)
    record.grids = measureFile(run, GridFile(request.file, request.memory));
  else
    for (const cli::FrameNumber frame : framesOf(request, *source))
      append(frame, measureFile(run, source->open(frame)), record);
  return record;
}

void judge(StabilityRecord& record) {
  for (const GridStability& grid : record.grids)
    for (const DeviceStability& device : grid.devices)
      if (!device.passes)
        record.failures.push_back("grid \"" + grid.name + "\", " + device.device + ": " +
                                  verdictOf(grid, device));
}

void throwFailures(const StabilityRequest& request, const StabilityRecord& record) {
  if (record.failures.empty()) return;
  std::string text = request.file.string() + " fails:";
  for (const auto& failure : record.failures) text += "\n  " + failure;
  throw TargetMissed(text);
}

}  // namespace

void stability(const StabilityRequest& request) {
  const cli::ThreadLimit threads(request.threads);
  const cli::Interrupts interrupts;
  checkFiles(request);
  const std::vector<Device> devices = devicesOf(request.device);
  StabilityRecord record = measured({request, devices, interrupts.token()});
  judge(record);
  if (!request.report.empty())
    cli::writeJson({request.report, request.overwrite}, stabilityReport(request, record));
  if (request.report != cli::kStandardOutput && request.verbosity != cli::Verbosity::kQuiet)
    printStability(record, std::cout);
  throwFailures(request, record);
}

}  // namespace esvr::compare
