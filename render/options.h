#pragma once
/// The options of esvr-render.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "esvr/render.h"
#include "programs/resources.h"
#include "programs/run_main.h"
#include "programs/sequence.h"
#include "render/scene.h"

namespace esvr::render {

inline constexpr const char* kProgram = "esvr-render";
/// The transfer function unless an option says otherwise.
inline constexpr const char *kUsualColors = "viridis", *kUsualOpacity = "linear";
inline constexpr const char* kUsualFurtherColors = "inferno";  ///< colors of the grids of --with

/// The range of values that the transfer function covers.
enum class RangeKind {
  kAuto,  ///< range of the active voxels and the background
  kData,  ///< range of the active voxels
  kOwn,   ///< range of the transfer function's own points
  kGiven
};

/// How a grid looks.
struct Look {
  /// The transfer function before it is rescaled to its range. Default: that of the grid's class.
  std::optional<TransferFunction> transfer;
  bool hasOpacity = false;  ///< whether the opacities of `transfer` were asked for, not only colors
  RangeKind rangeKind = RangeKind::kAuto;
  ValueRange range;  ///< the range of RangeKind::kGiven
};

/// A grid of --with.
struct FurtherGrid {
  std::string name;
  Look look;
  bool absorbs = true;  ///< see GridLook
};

struct Options {
  std::filesystem::path input;
  cli::InputFiles inputs;
  std::filesystem::path output;     ///< empty: no picture is written
  std::optional<std::string> grid;  ///< default: the first that can be drawn
  Look look;
  std::vector<FurtherGrid> with;  ///< grids that are drawn in the same picture
  CameraWish camera;
  Resolution resolution;
  double step = 1.0, opacityLength = 1.0;
  std::optional<double> minTransmittance;  ///< default: that of RenderOptions
  std::optional<Rgb> background;           ///< default: the picture is transparent
  bool legend = false;                     ///< draw a color bar
  int bits = 8;                            ///< bits of a PNG's channel
  Between between = Between::kVoxels;
  RenderMode mode = RenderMode::kComposite;
  Classification classification = Classification::kPreIntegrated;
  LevelOfDetail lod = LevelOfDetail::kAuto;
  std::optional<Shading> shading;
  std::optional<PlaceBox> clip;
  int turntable = 0;             ///< number of pictures of a full turn; 0: one picture
  int firstFrame = 0;            ///< first picture of the turn to draw
  std::optional<int> lastFrame;  ///< last picture of the turn to draw; default: the turn's last
  /// The frames to draw, if the input holds a sequence or is a pattern.
  std::optional<std::vector<cli::FrameNumber>> frames;
  std::optional<cli::FramePattern> pattern;  ///< the frames are files; nothing: the input has all
  std::string frameHint;                     ///< names that look like frames and are none
  double fps = 30.0;                         ///< pictures per second of a video
  std::filesystem::path depth;               ///< file of distances; empty: none
  std::filesystem::path saveTransfer;
  std::string device = "auto";
  RendererLimits limits;
  std::optional<NanoValues> values;  ///< form of the NanoVDB grid that voxels are marched in
  std::filesystem::path reference;   ///< empty: none
  int referenceSamples = 1;          ///< the reference is the mean of this number squared of rays
  std::filesystem::path sheet;       ///< empty: none
  bool bench = false;
  std::string report;  ///< empty: none
  bool overwrite = false;
  cli::HostMemory memory;  ///< memory that input may take
  int threads = 0;         ///< 0: all
  cli::Verbosity verbosity = cli::Verbosity::kNormal;
  std::vector<std::string> commandLine;  ///< the command as given, which pictures and reports hold
};

/// A clip box around a slab of one voxel's thickness, which is unbounded along the other axes.
/// \param axis   0, 1 or 2 for x, y or z
/// \param place  middle of the slab along the axis
[[nodiscard]] inline PlaceBox sliceBox(std::size_t axis, double place) {
  constexpr double kEverywhere = 1e9;  // voxels; larger than any coordinate in a grid
  PlaceBox box{{-kEverywhere, -kEverywhere, -kEverywhere}, {kEverywhere, kEverywhere, kEverywhere}};
  box.low[axis] = place - 0.5, box.high[axis] = place + 0.5;
  return box;
}

/// Parses the command line. \return nothing if --help or --version was printed
/// \throws UsageError  the options are wrong
/// \throws BadInput    the file of a transfer function or camera is wrong
[[nodiscard]] std::optional<Options> parseOptions(int argc, const char* const* argv);

}  // namespace esvr::render
