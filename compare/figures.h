#pragma once
/// The figures of a check: one table for options, reports, limits and baselines.

#include <array>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>

#include "esvr/metrics.h"

namespace esvr::compare {

enum class FigureId {
  kPsnrBox,
  kPsnrActive,
  kPsnrT90,
  kPsnrT50,
  kPsnrT10,
  kPsnrTemporal,
  kMaxError,
  kRelativeError,
  kP999Error,
  kIou,
  kSsim,
  kMassError,
  kMeshDistance
};
inline constexpr std::size_t kFigureCount = 13;

/// The default tolerance of a figure against a baseline.
struct Slack {
  double absolute = 0.0;
  double relative = 0.0;  ///< share of the baseline's value
};

/// The rows of a grid of vectors for which a limit holds: those of the components, as for the goals of a conversion, or
/// that of the lengths.
enum class LimitedRows { kAll, kComponents, kLengths };

struct Figure {
  FigureId id;
  const char* key;     ///< name in JSON: "psnr_box"
  const char* option;  ///< option of the limit: "min-psnr"
  const char* header;  ///< header of the table's column
  const char* unit;    ///< help text of the limit
  bool higherIsBetter;
  bool inValueUnits;  ///< whether a limit may be a share of the reference's range: "1%"
  Slack slack;
  LimitedRows rows = LimitedRows::kAll;
};

[[nodiscard]] std::span<const Figure> allFigures();

/// The figures of one grid; nothing for figures that were not measured.
using FigureValues = std::array<std::optional<double>, kFigureCount>;

[[nodiscard]] FigureValues figuresOf(const VolumeMetrics& metrics);
[[nodiscard]] std::optional<double> valueOf(const FigureValues& values, const Figure& figure);

/// |mass - reference's mass| / |reference's mass|; 0 if both are 0, infinite if only the
/// reference's is 0.
[[nodiscard]] double massError(const VolumeMetrics& metrics);

/// A figure as a table prints it: "51.54", "exact", "0.01234".
[[nodiscard]] std::string textOf(const Figure& figure, double value);

/// A number, or null if it is not finite, since JSON has no infinity.
[[nodiscard]] nlohmann::ordered_json finiteOrNull(double value);

}  // namespace esvr::compare
