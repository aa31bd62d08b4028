#pragma once
/// The figures that a gate looks at, one table for options, reports, limits and baselines.

#include <array>
#include <optional>
#include <span>
#include <string>

#include "esvr/metrics.h"

namespace esvr::compare {

enum class FigureId { kPsnrBox, kPsnrActive, kMaxError, kP999Error, kIou, kSsim, kMassError };
inline constexpr std::size_t kFigureCount = 7;

/// How far a figure may be worse than a baseline's before that is a regression.
struct Slack {
  double absolute = 0.0;
  double relative = 0.0;  ///< of the baseline's value
};

struct Figure {
  FigureId id;
  const char* key;     ///< in JSON: "psnr_box"
  const char* option;  ///< of the limit: "min-psnr"
  const char* header;  ///< of the table's column
  const char* unit;    ///< for the limit's help
  bool higherIsBetter;
  bool inValueUnits;  ///< a limit may be a share of the reference's range: "1%"
  Slack slack;
};

[[nodiscard]] std::span<const Figure> allFigures();

/// Of one grid; nothing where a figure was not asked for.
using FigureValues = std::array<std::optional<double>, kFigureCount>;

[[nodiscard]] FigureValues figuresOf(const VolumeMetrics& metrics);
[[nodiscard]] std::optional<double> valueOf(const FigureValues& values, const Figure& figure);

/// |mass - reference's| / |reference's|; 0 where both are 0, infinite where only the reference's
/// is.
[[nodiscard]] double massError(const VolumeMetrics& metrics);

/// As a table prints it: "51.54", "exact", "0.01234".
[[nodiscard]] std::string textOf(const Figure& figure, double value);

}  // namespace esvr::compare
