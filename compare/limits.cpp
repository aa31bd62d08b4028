#include "compare/limits.h"

namespace esvr::compare {
namespace {

bool misses(const Figure& figure, double value, double limit) {
  return figure.higherIsBetter ? value < limit : value > limit;
}

void judgeGrid(const CheckOptions& options, const CheckedGrid& grid,
               std::vector<std::string>& failures) {
  for (const Figure& figure : allFigures()) {
    const auto& bound = options.limits[std::size_t(figure.id)];
    const auto value = valueOf(grid.figures, figure);
    if (!bound || !value || (figure.inValueUnits && grid.isLengths)) continue;
    const double limit = bound->absolute(grid.range);
    if (misses(figure, *value, limit))
      failures.push_back("grid \"" + grid.name + "\": " + figure.header + " " +
                         textOf(figure, *value) + ", --" + figure.option + " " +
                         textOf(figure, limit));
  }
}

}  // namespace

void judgeLimits(const CheckOptions& options, CheckRecord& record) {
  for (const CheckedGrid& grid : record.grids) judgeGrid(options, grid, record.failures);
}

void judgeBytes(const CheckOptions& options, CheckRecord& record) {
  if (options.maxBytes && record.candidateBytes > *options.maxBytes)
    record.failures.push_back(std::to_string(record.candidateBytes) + " bytes, --max-bytes " +
                              std::to_string(*options.maxBytes));
}

void judgeDifferences(const CheckOptions& options, CheckRecord& record) {
  const auto judge = [&](const std::string& where, const std::vector<Difference>& differences) {
    for (const auto& difference : differences)
      if (options.failOn.contains(difference.kind))
        record.failures.push_back(where + difference.text);
  };
  judge("file ", record.fileDifferences);
  for (const auto& grid : record.grids) judge("grid \"" + grid.name + "\": ", grid.differences);
}

}  // namespace esvr::compare
