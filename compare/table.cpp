#include "compare/table.h"

#include <cmath>
#include <iostream>
#include <set>

#include "cli/interrupts.h"
#include "cli/json_file.h"
#include "cli/thread_limit.h"
#include "compare/program.h"
#include "compare/row_plan.h"
#include "compare/scene_files.h"
#include "compare/table_report.h"
#include "esvr/error.h"

namespace esvr::compare {
namespace {

/// Makes one row after the other. Finished rows are kept if the run is interrupted.
class TableRun {
 public:
  TableRun(const TableScene& scene, TableRecord& record, const cli::Log& log)
      : scene_(scene), options_(scene.options), record_(record), log_(log), maker_(scene) {}

  void run() try {
    record_.halfBlosc = maker_.baseline("", halfBlosc(), "").bytes;
    for (const auto& path : options_.candidates) {
      add(maker_.candidate(path));
    }
    for (const auto& external : options_.externals) add(maker_.external(external));
    if (options_.fitDefault) add(maker_.fitted({}));
    if (options_.fitPaper) add(maker_.fitted({.paper = true}));
    for (const std::uint64_t bytes : options_.fits) add(maker_.fitted({.bytes = bytes}));
    for (const auto& setting : options_.settings) addBaseline("given", setting);
    if (options_.settings.empty()) plainRows();
    matchedRows();
  } catch (const Cancelled&) {
    record_.interrupted = true;
  }

 private:
  void add(TableRow row) {
    if (scene_.cancel.cancelled()) throw Cancelled();
    log_.detail("made " + row.group + ": " + row.name);
    record_.rows.push_back(std::move(row));
  }

  void addBaseline(const std::string& group, const BaselineSetting& setting) {
    add(maker_.baseline(group, setting, displayName(setting)));
  }

  void plainRows() {
    if (options_.lossless)
      for (const auto& setting : losslessSettings()) addLossless(setting);
    if (options_.quantised)
      for (const auto& [setting, name] : quantisedSettings(scene_.peak))
        add(maker_.baseline(kQuantisedGroup, setting, name));
  }

  /// Half floats have an error unless the values are half floats themselves.
  void addLossless(const BaselineSetting& setting) {
    TableRow row = maker_.baseline(kLosslessGroup, setting, displayName(setting));
    if (row.metrics && row.metrics->maxError > 0.0) row.group = kNearlyLosslessGroup;
    add(std::move(row));
  }

  void matchedRows() {
    std::set<std::uint64_t> sizes(options_.sizes.begin(), options_.sizes.end());
    std::set<double> psnrs(options_.psnrs.begin(), options_.psnrs.end());
    for (const auto& row : record_.rows) {
      if (row.group != kOurGroup) continue;
      sizes.insert(*row.bytes);
      if (std::isfinite(row.metrics->psnrBox)) psnrs.insert(row.metrics->psnrBox);
    }
    for (const std::uint64_t bytes : sizes) {
      for (const auto& form : sizeForms(options_)) add(maker_.sizeMatched(form, bytes));
      for (const auto& command : options_.commands) add(maker_.sizeMatched(command, bytes));
    }
    for (const double psnr : psnrs) {
      const MatchGoal goal{.psnr = psnr};
      for (const auto& form : psnrForms(options_)) add(maker_.psnrMatched(form, goal));
      for (const auto& command : options_.commands) add(maker_.psnrMatched(command, goal));
    }
    for (const double psnr : options_.activePsnrs) {
      const MatchGoal goal{.psnr = psnr, .active = true, .dropsVoxels = true};
      for (const auto& form : activePsnrForms(options_)) add(maker_.psnrMatched(form, goal));
      for (const auto& command : options_.commands) add(maker_.psnrMatched(command, goal));
    }
  }

  const TableScene& scene_;
  const TableOptions& options_;
  TableRecord& record_;
  const cli::Log& log_;
  RowMaker maker_;
};

void checkFiles(const TableOptions& options) { checkReportFiles(options.files, inputsOf(options)); }

void tell(const TableOptions& options, const TableRecord& record) {
  writeReports(options, record);
  if (options.files.json != cli::kStandardOutput && options.verbosity != cli::Verbosity::kQuiet)
    printTable(record, options.verbosity == cli::Verbosity::kVerbose, std::cout);
}

}  // namespace

void table(const TableOptions& options) {
  const cli::ThreadLimit threads(options.threads);
  const cli::Interrupts interrupts;
  const cli::Log log(kProgram, options.verbosity);
  checkFiles(options);
  const SceneFiles files(options, interrupts.token());
  TableRecord record = files.record();
  if (options.zfp && zfpVersion().empty())
    log.warning("this build has no ZFP; the table has no rows for it");
  const TableScene scene = files.scene();
  TableRun(scene, record, log).run();
  const Completion completion;  // finished rows are written after an interruption, too
  tell(options, record);
  requireAllRows(record);
}

}  // namespace esvr::compare
