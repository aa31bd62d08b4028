#include "compare/figures.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string_view>

#include "compare/check.h"
#include "esvr/error.h"
#include "programs/files.h"
#include "programs/option_values.h"
#include "programs/run_main.h"

namespace esvr::compare {

// How errors are measured.

std::vector<std::string> commandLine(int argc, const char* const* argv) {
  std::vector<std::string> words{kProgram};
  words.insert(words.end(), argv, argv + argc);
  return words;
}

void addMeasureOptions(cli::po::options_description& options) {
  // clang-format off
  options.add_options()
    ("box", cli::po::value<std::string>()->value_name("BOX"),
     "box x0,y0,z0,x1,y1,z1 over which figures are measured (default: the bounding box of "
     "the reference's active voxels)")
    ("peak", cli::po::value<double>()->value_name("P"),
     "peak of the PSNR (default: the range of the reference's values, "
     "which is the largest value of a density; docs/compare.md)");
  // clang-format on
}

std::optional<Box> boxOption(const cli::Arguments& a) {
  const auto box = a.find<std::string>("box");
  return box ? std::optional(cli::parseBox(*box)) : std::nullopt;
}

std::optional<double> peakOption(const cli::Arguments& a) {
  const auto peak = a.find<double>("peak");
  if (peak)
    cli::requireRange("peak", *peak, std::numeric_limits<double>::min(),
                      std::numeric_limits<double>::max());
  return peak;
}

void addJsonReport(cli::po::options_description& options) {
  options.add_options()("report", cli::po::value<std::string>()->value_name("FILE.json"),
                        "write all results as JSON; '-' is stdout");
}

// The figures.

namespace {

/// A PSNR, of which 0.05 dB less than in a baseline are tolerated. A goal of a conversion is that of each component; that
/// of the lengths is up to 4.8 dB lower, since the error of a length is at most sqrt(3) times as large.
constexpr Figure psnrFigure(FigureId id, const char* key, const char* option, const char* header,
                            const char* unit) {
  return {id, key, option, header, unit, true, false, {.absolute = 0.05}, LimitedRows::kComponents};
}

/// A share, which is better if it is higher.
constexpr Figure shareFigure(FigureId id, const char* key, const char* option, const char* header,
                             const char* unit) {
  return {id, key, option, header, unit, true, false, {.absolute = 0.002}};
}

/// An error, of which a limit may be in units of the values.
constexpr Figure errorFigure(FigureId id, const char* key, const char* option, const char* header,
                             const char* unit, Slack slack, bool inValueUnits = false) {
  return {id,           key,   option,
          header,       unit,  false,
          inValueUnits, slack, inValueUnits ? LimitedRows::kComponents : LimitedRows::kAll};
}

/// An error of a sum. The values of a component cancel each other, so that a share of their sum says nothing.
constexpr Figure massFigure(FigureId id, const char* key, const char* option, const char* header,
                            const char* unit) {
  return {id, key, option, header, unit, false, false, {.absolute = 0.001}, LimitedRows::kLengths};
}

constexpr std::array<Figure, kFigureCount> kFigures{
    psnrFigure(FigureId::kPsnrActive, "psnr_active", "min-psnr-active", "PSNR active",
               "smallest PSNR over the active voxels, dB"),
    psnrFigure(FigureId::kPsnrBox, "psnr_box", "min-psnr", "PSNR box",
               "smallest PSNR over the box, dB"),
    psnrFigure(FigureId::kPsnrT90, "psnr_t90", "min-psnr-t90", "PSNR T 0.9",
               "of grids that are looked through: smallest PSNR of the transmittance, where "
               "the median column lets 90 % of the light through, dB"),
    psnrFigure(FigureId::kPsnrT50, "psnr_t50", "min-psnr-t50", "PSNR T 0.5",
               "the same where it lets 50 % of the light through, dB"),
    psnrFigure(FigureId::kPsnrT10, "psnr_t10", "min-psnr-t10", "PSNR T 0.1",
               "the same where it lets 10 % of the light through, dB"),
    psnrFigure(FigureId::kPsnrTemporal, "psnr_temporal", "min-psnr-temporal", "temporal",
               "of sequences: smallest PSNR of the temporal difference, which is each frame "
               "minus the frame before it, dB"),
    errorFigure(FigureId::kMaxError, "max_error", "max-error", "max error",
                "largest error of a voxel: 0.02, or 1% of the reference's range",
                {.relative = 0.02}, true),
    errorFigure(FigureId::kRelativeError, "relative_error", "max-relative-error", "relative error",
                "largest error relative to the value of each voxel: 1%, or 1%,0.001 if it may "
                "be as large as for 0.001 where values are smaller; measured if there is a "
                "limit on it",
                {.relative = 0.02}),
    errorFigure(FigureId::kP999Error, "p999_error", "max-p999-error", "p99.9 error",
                "largest 99.9th percentile of the error: 0.01, or 0.5% of the reference's range",
                {.relative = 0.02}, true),
    shareFigure(FigureId::kIou, "iou", "min-iou", "IoU",
                "smallest overlap (intersection over union) of the active voxels, 0 to 1"),
    shareFigure(FigureId::kSsim, "ssim", "min-ssim", "SSIM", "smallest 3D SSIM over the box"),
    massFigure(FigureId::kMassError, "mass_error", "max-mass-error", "mass error",
               "largest relative error of the sum of (value - background)"),
    errorFigure(FigureId::kMeshDistance, "mesh_distance", "max-mesh-distance", "mesh distance",
                "of level sets: largest Hausdorff distance of the meshes of the zero "
                "crossings, in voxels",
                {.absolute = 0.01})};

bool isPsnr(const Figure& figure) { return std::string_view(figure.key).starts_with("psnr_"); }

}  // namespace

std::span<const Figure> allFigures() { return kFigures; }

double massError(const VolumeMetrics& m) {
  const double difference = std::abs(m.massCandidate - m.massReference);
  if (difference == 0.0) return 0.0;
  if (m.massReference == 0.0) return std::numeric_limits<double>::infinity();
  return difference / std::abs(m.massReference);
}

FigureValues figuresOf(const VolumeMetrics& m) {
  FigureValues values;
  const auto set = [&](FigureId id, std::optional<double> value) {
    values[std::size_t(id)] = value;
  };
  set(FigureId::kPsnrBox, m.psnrBox);
  set(FigureId::kPsnrActive, m.psnrActive);
  if (m.transmittance) {
    set(FigureId::kPsnrT90, m.transmittance->psnr90);
    set(FigureId::kPsnrT50, m.transmittance->psnr50);
    set(FigureId::kPsnrT10, m.transmittance->psnr10);
  }
  set(FigureId::kMaxError, m.maxError);
  set(FigureId::kP999Error, m.p999Error);
  set(FigureId::kIou, m.iou);
  set(FigureId::kSsim, m.ssim);
  set(FigureId::kMassError, massError(m));
  return values;
}

std::optional<double> valueOf(const FigureValues& values, const Figure& figure) {
  return values[std::size_t(figure.id)];
}

std::string textOf(const Figure& figure, double value) {
  return isPsnr(figure) ? cli::decibels(value) : cli::shortNumber(value);
}

std::pair<std::string, std::string> textsApart(const Figure& figure, double value, double other) {
  return isPsnr(figure) ? cli::decibelsApart(value, other) : cli::shortNumbersApart(value, other);
}

nlohmann::ordered_json finiteOrNull(double value) {
  return std::isfinite(value) ? nlohmann::ordered_json(value) : nlohmann::ordered_json();
}

// ---- Judgements

// Limits.

namespace {

bool isLimited(const CheckedGrid& grid, const Figure& figure) {
  return !grid.vectors || figure.rows == LimitedRows::kAll || figure.rows == *grid.vectors;
}

}  // namespace

void judgeLimits(const CheckOptions& options, CheckRecord& record) {
  for (const CheckedGrid& grid : record.grids)
    for (const Figure& figure : allFigures()) {
      const auto& bound = options.limits[std::size_t(figure.id)];
      const auto value = valueOf(grid.figures, figure);
      if (!bound || !value || !isLimited(grid, figure)) continue;
      const double limit = bound->absolute(grid.range);
      if (figure.higherIsBetter ? *value >= limit : *value <= limit) continue;
      const auto [found, allowed] = textsApart(figure, *value, limit);
      record.failures.push_back("grid \"" + grid.name + "\": " + figure.header + " " + found +
                                ", --" + figure.option + " " + allowed);
    }
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

// Baselines.

namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kBaselineSchema = "esvr-baseline";
constexpr int kBaselineVersion = 1;
constexpr double kBytesTolerance = 0.01;  // default tolerance of the size, as a share of it

[[noreturn]] void notABaseline(const std::filesystem::path& path, const std::string& why) {
  throw BadInput(path.string() + ": not a baseline: " + why);
}

struct Entry {
  double value = 0.0, tolerance = 0.0;
};

/// \param json  object with "value" and "tolerance"
Entry entryOf(const std::filesystem::path& path, const std::string& what, const Json& json) {
  constexpr const char *kValue = "value", *kTolerance = "tolerance";
  if (!json.is_object()) notABaseline(path, what + " is no object with a value and a tolerance");
  for (const auto& item : json.items())
    if (item.key() != kValue && item.key() != kTolerance)
      notABaseline(path, what + " has \"" + item.key() + "\", which is neither of both");
  const auto number = [&](const char* key) {
    if (!json.contains(key)) notABaseline(path, what + " has no " + key);
    if (!json[key].is_number()) notABaseline(path, what + ": " + key + " is not a number");
    return json[key].get<double>();
  };
  const bool isInfinite = json.contains(kValue) && json[kValue].is_null();
  const Entry entry{isInfinite ? std::numeric_limits<double>::infinity() : number(kValue),
                    number(kTolerance)};
  if (!(entry.tolerance >= 0.0)) notABaseline(path, what + ": the tolerance is below 0");
  return entry;
}

/// Checks the figures of a grid: a figure that is misspelt would not be checked.
void requireFigures(const std::filesystem::path& path, const std::string& grid, const Json& json) {
  const std::string where = "grid \"" + grid + "\"";
  if (!json.is_object()) notABaseline(path, where + " is no object with figures");
  if (json.empty()) notABaseline(path, where + " has no figures");
  for (const auto& item : json.items()) {
    const auto isIt = [&](const Figure& figure) { return figure.key == item.key(); };
    if (std::ranges::none_of(allFigures(), isIt))
      notABaseline(path, where + " has \"" + item.key() + "\", which is no figure");
    (void)entryOf(path, where + ": " + item.key(), item.value());
  }
}

Json readBaseline(const std::filesystem::path& path) {
  if (!std::filesystem::exists(path))
    throw BadInput(path.string() + ": cannot be read (--update makes it)");
  Json json = Json::parse(cli::readText(path), nullptr, false);
  if (json.is_discarded() || !json.is_object()) notABaseline(path, "no JSON object");
  if (json.value("schema", Json()) != kBaselineSchema)
    notABaseline(path, std::string("its \"schema\" is not \"") + kBaselineSchema + '"');
  if (json.value("schema_version", Json()) != kBaselineVersion)
    notABaseline(path, "its \"schema_version\" is not " + std::to_string(kBaselineVersion));
  if (!json.contains("grids") || !json["grids"].is_object()) notABaseline(path, "no \"grids\"");
  if (json.contains("bytes") && !std::isfinite(entryOf(path, "bytes", json["bytes"]).value))
    notABaseline(path, "bytes: value is not a number");
  for (const auto& grid : json["grids"].items()) requireFigures(path, grid.key(), grid.value());
  return json;
}

enum class Verdict { kWithin, kWorse, kBetter };

Verdict judge(bool higherIsBetter, const Entry& entry, double value) {
  if (value == entry.value) return Verdict::kWithin;  // both may be infinite
  const double gain = higherIsBetter ? value - entry.value : entry.value - value;
  if (gain < -entry.tolerance) return Verdict::kWorse;
  return gain > entry.tolerance ? Verdict::kBetter : Verdict::kWithin;
}

void tell(Verdict verdict, const std::string& text, CheckRecord& record) {
  if (verdict == Verdict::kWorse) record.failures.push_back(text);
  if (verdict == Verdict::kBetter) record.notes.push_back(text + ": better");
}

void judgeFigures(const std::filesystem::path& path, const Json& stored, const CheckedGrid& grid,
                  CheckRecord& record) {
  for (const Figure& figure : allFigures()) {
    const auto value = valueOf(grid.figures, figure);
    if (!stored.contains(figure.key)) continue;
    const std::string where = "grid \"" + grid.name + "\": " + figure.header;
    if (!value) {
      record.notes.push_back(where + " of the baseline was not measured");
      continue;
    }
    const Entry entry = entryOf(path, where, stored[figure.key]);
    const auto [found, wanted] = textsApart(figure, *value, entry.value);
    tell(judge(figure.higherIsBetter, entry, *value),
         where + " " + found + ", baseline " + wanted + " within " +
             cli::shortNumber(entry.tolerance),
         record);
  }
}

void judgeSize(const std::filesystem::path& path, const Json& baseline, CheckRecord& record) {
  if (!baseline.contains("bytes")) return;
  const Entry entry = entryOf(path, "bytes", baseline["bytes"]);
  tell(judge(false, entry, double(record.candidateBytes)),
       std::to_string(record.candidateBytes) + " bytes, baseline " +
           std::to_string(std::uint64_t(std::max(entry.value, 0.0))) + " within " +
           cli::shortNumber(entry.tolerance),
       record);
}

double toleranceOf(const Json& old, const char* key, double fallback) {
  if (!old.is_object() || !old.contains(key)) return fallback;
  const Json& entry = old[key];
  const bool has =
      entry.is_object() && entry.contains("tolerance") && entry["tolerance"].is_number();
  return has ? entry["tolerance"].get<double>() : fallback;
}

Json gridEntry(const CheckedGrid& grid, const Json& old) {
  Json json = Json::object();
  for (const Figure& figure : allFigures()) {
    const auto value = valueOf(grid.figures, figure);
    if (!value) continue;
    const double scale = std::isfinite(*value) ? std::abs(*value) : 0.0;
    const double slack = figure.slack.absolute + figure.slack.relative * scale;
    json[figure.key] = {{"value", finiteOrNull(*value)},
                        {"tolerance", toleranceOf(old, figure.key, slack)}};
  }
  return json;
}

}  // namespace

void judgeBaseline(const std::filesystem::path& path, CheckRecord& record) {
  const Json baseline = readBaseline(path);
  judgeSize(path, baseline, record);
  const Json& stored = baseline["grids"];
  for (const auto& grid : record.grids) {
    if (stored.contains(grid.name))
      judgeFigures(path, stored[grid.name], grid, record);
    else
      record.notes.push_back("grid \"" + grid.name +
                             "\" is not in the baseline (--update adds it)");
  }
  for (const auto& item : stored.items()) {
    const std::string& name = item.key();
    const auto same = [&](const CheckedGrid& grid) { return grid.name == name; };
    if (std::none_of(record.grids.begin(), record.grids.end(), same))
      record.failures.push_back("grid \"" + name + "\" of the baseline was not compared");
  }
}

bool baselineHasSsim(const std::filesystem::path& path) {
  if (!std::filesystem::exists(path)) return false;
  const Json baseline = readBaseline(path);
  for (const auto& grid : baseline["grids"])
    if (grid.contains("ssim")) return true;
  return false;
}

void updateBaseline(const std::filesystem::path& path, const CheckRecord& record) {
  const Json old = std::filesystem::exists(path) ? readBaseline(path) : Json::object();
  const Json oldGrids = old.value("grids", Json::object());
  Json grids = Json::object();
  for (const auto& grid : record.grids)
    grids[grid.name] = gridEntry(grid, oldGrids.value(grid.name, Json()));
  const Json json{
      {"schema", kBaselineSchema},
      {"schema_version", kBaselineVersion},
      {"bytes",
       {{"value", record.candidateBytes},
        {"tolerance", toleranceOf(old, "bytes", kBytesTolerance * double(record.candidateBytes))}}},
      {"grids", std::move(grids)}};
  cli::writeJson({path.string(), true}, json);
}

}  // namespace esvr::compare
