#pragma once
/// What the commands of esvr-compare share: how errors are measured, and the figures, of which one table is that of
/// options, reports, limits and baselines.

#include <array>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "esvr/metrics.h"
#include "esvr/volume.h"
#include "programs/command_line.h"

namespace esvr::compare {

inline constexpr const char* kProgram = "esvr-compare";

/// The whole command line as words. \param argv  arguments, beginning with the command
[[nodiscard]] std::vector<std::string> commandLine(int argc, const char* const* argv);

/// Adds --box and --peak, which say how errors are measured.
void addMeasureOptions(cli::po::options_description& options);
/// \throws UsageError  the text is no box
[[nodiscard]] std::optional<Box> boxOption(const cli::Arguments& arguments);
/// \throws UsageError  the peak is not above 0
[[nodiscard]] std::optional<double> peakOption(const cli::Arguments& arguments);

/// Adds --report.
void addJsonReport(cli::po::options_description& options);

// The figures of a check.

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
