#include "compare/curves.h"

#include <set>

#include "cli/interrupts.h"
#include "cli/output.h"
#include "cli/thread_limit.h"
#include "compare/curves_files.h"
#include "compare/program.h"
#include "compare/row_plan.h"
#include "compare/scene_files.h"
#include "esvr/error.h"

namespace esvr::compare {
namespace {

/// Default sizes of fits: the size of the half-float Blosc VDB divided by these numbers.
constexpr std::uint64_t kParts[] = {10, 20, 50, 100, 200, 400};

void checkFiles(const CurvesOptions& options) {
  const auto files = curveFiles(options.prefix);
  cli::requireSeparate(inputsOf(options.table), files);
  for (const auto& file : files) {
    cli::checkOutput(file, {".csv", ".json", ".html"}, options.overwrite);
  }
}

/// Makes the rows of the curves. Finished rows are kept if the run is interrupted.
class CurvesRun {
 public:
  CurvesRun(const TableScene& scene, TableRecord& record, const cli::Log& log)
      : scene_(scene), record_(record), log_(log), maker_(scene) {}

  void run() try {
    for (const auto& path : scene_.options.candidates) add(maker_.candidate(path));
    for (const std::uint64_t bytes : fitSizes()) addFit(bytes);
    std::set<std::uint64_t> sizes;
    for (const auto& row : record_.rows) sizes.insert(*row.bytes);
    for (const std::uint64_t bytes : sizes)
      for (const auto& form : sizeForms(scene_.options)) add(maker_.sizeMatched(form, bytes));
  } catch (const Cancelled&) {
    record_.interrupted = true;
  }

 private:
  [[nodiscard]] std::vector<std::uint64_t> fitSizes() {
    const TableOptions& options = scene_.options;
    if (!options.fits.empty() || !options.candidates.empty()) return options.fits;
    const TableRow half = maker_.baseline("", halfBlosc(), "");
    if (!half.bytes) throw UsageError(half.note + "; set sizes with --fit");
    std::vector<std::uint64_t> sizes;
    for (const std::uint64_t part : kParts) sizes.push_back(*half.bytes / part);
    return sizes;
  }

  /// Adds a fit of a size. A default size may be too small and is then skipped with a warning.
  void addFit(std::uint64_t bytes) try {
    add(maker_.fitted({.bytes = bytes}));
  } catch (const UsageError& error) {
    if (!scene_.options.fits.empty()) throw;
    log_.warning("no fit of " + std::to_string(bytes) + " bytes: " + error.what());
  }

  void add(TableRow row) {
    if (scene_.cancel.cancelled()) throw Cancelled();
    log_.detail("made " + row.group + ": " + row.name);
    record_.rows.push_back(std::move(row));
  }

  const TableScene& scene_;
  TableRecord& record_;
  const cli::Log& log_;
  RowMaker maker_;
};

}  // namespace

void curves(const CurvesOptions& options) {
  const cli::ThreadLimit threads(options.table.threads);
  const cli::Interrupts interrupts;
  const cli::Log log(kProgram, options.table.verbosity);
  checkFiles(options);
  const SceneFiles files(options.table, interrupts.token());
  TableRecord record = files.record();
  const TableScene scene = files.scene();
  CurvesRun(scene, record, log).run();
  const Completion completion;  // finished rows are written after an interruption, too
  writeCurves(options.prefix, {options.table.reference, record, options.table.commandLine},
              options.overwrite);
  for (const auto& file : curveFiles(options.prefix)) log.info("wrote " + file.string());
  requireAllRows(record);
}

}  // namespace esvr::compare
