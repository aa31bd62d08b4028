#include "compare/check.h"

#include <algorithm>
#include <iostream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "cli/interrupts.h"
#include "cli/json_file.h"
#include "cli/output.h"
#include "cli/sequence.h"
#include "cli/thread_limit.h"
#include "compare/baseline.h"
#include "compare/check_report.h"
#include "compare/check_sequence.h"
#include "compare/compare_files.h"
#include "compare/limits.h"
#include "compare/program.h"
#include "esvr/error.h"

namespace esvr::compare {
namespace {

void checkFiles(const CheckOptions& options) {
  std::vector<std::filesystem::path> inputs, outputs{options.report};
  for (const auto& input : {options.reference, options.candidate})
    std::ranges::copy(cli::filesOfInput(input.string()), std::back_inserter(inputs));
  if (options.baseline) (options.update ? outputs : inputs).push_back(*options.baseline);
  cli::requireSeparate(inputs, outputs);
  if (!options.report.empty() && options.report != cli::kStandardOutput)
    cli::checkOutput(options.report, {".json"}, options.overwrite);
  if (options.update) cli::checkOutput(*options.baseline, {".json"}, true);
}

void tell(const CheckOptions& options, const CheckRecord& record) {
  if (!options.report.empty())
    cli::writeJson({options.report, options.overwrite}, checkReport(options, record));
  if (options.report != cli::kStandardOutput && options.verbosity != cli::Verbosity::kQuiet)
    printCheck(record, std::cout);
}

/// A missed limit or a difference counts more than a grid that cannot be read.
void throwFailures(const CheckOptions& options, const CheckRecord& record) {
  if (record.failures.empty() && record.unreadable.empty()) return;
  std::string text = options.candidate.string() + " fails:";
  for (const auto& failure : record.failures) text += "\n  " + failure;
  for (const auto& failure : record.unreadable) text += "\n  " + failure;
  if (record.failures.empty()) throw BadInput(text);
  throw TargetMissed(text);
}

/// Compares the files or the sequences, and judges the size.
CheckRecord compared(const CheckOptions& options, const CancelToken& cancel) {
  if (areSequences(options)) return checkSequence(options, cancel);
  if (options.frames || options.limits[std::size_t(FigureId::kPsnrTemporal)])
    throw UsageError("--frames and --min-psnr-temporal need sequences");
  const GridFile reference(options.reference, options.memory),
      candidate(options.candidate, options.memory);
  return compareFiles(options, {reference, candidate, cancel}, nullptr);
}

}  // namespace

void check(const CheckOptions& options) {
  const cli::ThreadLimit threads(options.threads);
  const cli::Interrupts interrupts;
  checkFiles(options);
  CheckRecord record = compared(options, interrupts.token());
  judgeBytes(options, record);
  if (options.baseline && !options.update) judgeBaseline(*options.baseline, record);

  tell(options, record);
  throwFailures(options, record);
  if (options.update) updateBaseline(*options.baseline, record);
}

}  // namespace esvr::compare
