#include "compare/figures.h"

#include <cmath>
#include <limits>
#include <string_view>

#include "programs/messages.h"

namespace esvr::compare {
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

nlohmann::ordered_json finiteOrNull(double value) {
  return std::isfinite(value) ? nlohmann::ordered_json(value) : nlohmann::ordered_json();
}

}  // namespace esvr::compare
