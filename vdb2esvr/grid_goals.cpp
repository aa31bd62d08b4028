#include "vdb2esvr/grid_goals.h"

#include <algorithm>
#include <set>
#include <utility>
#include <variant>

#include "cli/error_bound.h"
#include "cli/number.h"
#include "esvr/error.h"
#include "esvr/grid_names.h"
#include "vdb2esvr/options.h"

namespace esvr::vdb2esvr {
namespace {

constexpr double kHighestPsnr = 300.0;  // dB; float32 reaches about 150

/// One of the values of an option, between commas.
struct NamedValue {
  std::string grid;  ///< empty: all others
  std::string value;
};

std::vector<NamedValue> valuesOf(const std::string& option, const std::string& text) {
  std::vector<NamedValue> values;
  for (const std::string& part : cli::splitText(text, ',')) {
    const std::size_t at = part.rfind('=');
    const bool isNamed = at != std::string::npos;
    values.push_back({isNamed ? part.substr(0, at) : "", isNamed ? part.substr(at + 1) : part});
    if (isNamed && values.back().grid.empty())
      throw UsageError("--" + option + ": there is no name before '=' in '" + text + "'");
  }
  if (std::ranges::count(values, std::string(), &NamedValue::grid) > 1)
    throw UsageError("--" + option + ": '" + text + "' has two values without a name");
  return values;
}

double psnrIn(const std::string& text) {
  const auto psnr = cli::parseNumber(text);
  if (!psnr) throw UsageError("--psnr must be a number such as 40, not '" + text + "'");
  cli::requireRange("psnr", *psnr, 0.0, kHighestPsnr);
  return *psnr;
}

void addGoal(const std::string& grid, Goal goal, Options& options) {
  if (std::ranges::count(options.gridGoals, grid, &GridGoal::grid) > 0)
    throw UsageError("grid \"" + shownName(grid) + "\" has two goals");
  options.gridGoals.push_back({grid, std::move(goal)});
}

void readPsnr(const std::string& text, Options& options) {
  for (const NamedValue& value : valuesOf("psnr", text))
    if (value.grid.empty())
      options.psnr = psnrIn(value.value);
    else
      addGoal(value.grid, PsnrGoal{psnrIn(value.value)}, options);
}

void readMaxError(const std::string& text, Options& options) {
  for (const NamedValue& value : valuesOf("max-error", text)) {
    const cli::ErrorBound bound = cli::parseErrorBound("max-error", value.value);
    if (value.grid.empty())
      options.maxError = BoundGoal{bound.amount, bound.relative};
    else
      addGoal(value.grid, BoundGoal{bound.amount, bound.relative}, options);
  }
}

}  // namespace

void readGridGoals(const cli::Arguments& a, Options& options) {
  if (const auto text = a.find<std::string>("psnr")) readPsnr(*text, options);
  if (const auto text = a.find<std::string>("max-error")) readMaxError(*text, options);
}

void resolveNames(const VdbSummary& input, Options& options) {
  const GridNames names = namesOf(input);
  std::set<std::size_t> withGoals;
  for (GridGoal& own : options.gridGoals) {
    own.place = names.findWhole(own.grid, options.input);
    if (!withGoals.insert(own.place).second)
      throw UsageError("grid \"" + names.unique(own.place) + "\" has two goals");
  }
}

std::optional<std::size_t> ownGoalOf(const Options& options, const FittedGrid& grid) {
  const auto own = std::ranges::find(options.gridGoals, grid.place, &GridGoal::place);
  if (own == options.gridGoals.end()) return std::nullopt;
  return std::size_t(own - options.gridGoals.begin());
}

const Goal& goalOf(const Options& options, const FittedGrid& grid) {
  const auto own = ownGoalOf(options, grid);
  return own ? options.gridGoals[*own].goal : options.convert.goal;
}

std::optional<double> wantedPsnrOf(const Options& options, const FittedGrid& grid) {
  if (!ownGoalOf(options, grid)) return options.psnr;
  const auto* psnr = std::get_if<PsnrGoal>(&goalOf(options, grid));
  return psnr ? std::optional(psnr->psnr) : std::nullopt;
}

}  // namespace esvr::vdb2esvr
