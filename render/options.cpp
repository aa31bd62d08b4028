#include "render/options.h"

#include <charconv>

#include "cli/choice.h"
#include "cli/command_line.h"
#include "cli/memory_limit.h"
#include "cli/number_list.h"
#include "render/camera_file.h"

namespace esvr::render {
namespace {

using cli::Arguments;
using cli::po::bool_switch;
using cli::po::value;

constexpr int kMaxSide = Resolution::kMaxSide;
constexpr int kMaxFrames = 9999;   // the number in a frame's file name has four digits
constexpr double kMinStep = 1e-3;  // voxels
constexpr int kMaxBins = 16;
constexpr double kMinVram = 0.001, kMaxVram = 1e4;  // GB

/// Formats "title: one, two, three." for a help text, with line breaks.
std::string listOf(const std::string& title, const std::vector<std::string>& names) {
  constexpr std::size_t kLine = 80;
  std::string text, line = title + ":";
  for (std::size_t i = 0; i < names.size(); ++i) {
    const std::string word = " " + names[i] + (i + 1 < names.size() ? "," : ".");
    if (line.size() + word.size() > kLine) text += line + "\n", line = " ";
    line += word;
  }
  return text + line + "\n";
}

std::string notes() {
  return "IN may be an .esvr, a .vdb or an .nvdb file. All are drawn with the same camera,\n"
         "samples, transfer function and compositing. Voxels are interpolated trilinearly. An\n"
         ".esvr file that stores voxels is drawn from these voxels. A residual and a stored\n"
         "active mask are drawn with --method bricks only.\n"
         "\n"
         "Positions and lengths are in voxels of the grid's index space; its transform is not\n"
         "applied. By default the camera sees all active voxels. Samples whose value is exactly\n"
         "the background are transparent.\n"
         "\n" +
         listOf("Color maps", builtInColorMaps()) + listOf("Opacity curves", builtInOpacities()) +
         "\n"
         "CAM.json has the values of the camera options: {\"eye\": [1, 2, 3], \"center\": [...],\n"
         "\"up\": [...], \"fov\": 30}, or \"height\" for an orthographic camera.\n"
         "\n"
         "--ref also draws the voxels of a VDB with the same camera, on the same device, and\n"
         "prints the error of each picture. OUT.error.png shows ten times the error.\n"
         "--bench draws a full turn, writes no picture, and reports the frames per second and the\n"
         "times of the parts of a frame; with --ref it does so for both files.\n"
         "\n"
         "A PNG file holds sRGB colors that are not premultiplied by alpha. An EXR file holds\n"
         "floats in linear light that are premultiplied. Both hold the command line in their\n"
         "metadata.\n"
         "\n"
         "Exit codes: 0 done, 1 failure, 2 wrong options, 3 input that is damaged or cannot be\n"
         "used, 5 no such device or not enough memory (--max-memory, --max-vram).";
}

cli::ProgramText programText() {
  return {.name = kProgram,
          .purpose =
              "Draws a picture of an .esvr file, or of a VDB for comparison, through a transfer\n"
              "function. The ellipsoids of an .esvr file are drawn directly, without decoding the\n"
              "whole grid to voxels first.",
          .usage =
              "  esvr-render IN.esvr OUT.png|OUT.exr [OPTION]...\n"
              "  esvr-render IN.vdb OUT.png|OUT.exr [OPTION]...\n"
              "  esvr-render IN.esvr --bench [--ref IN.vdb] [--report FILE.json] [OPTION]...",
          .notes = notes(),
          .examples =
              "  esvr-render smoke.esvr smoke.png\n"
              "  esvr-render smoke.vdb reference.png              the original, to compare\n"
              "  esvr-render smoke.esvr smoke.png --colors inferno --opacity-length 4\n"
              "  esvr-render smoke.esvr smoke.png --tf presets.json --preset Smoke\n"
              "  esvr-render smoke.esvr turn.png --turntable 36   turn.0000.png to turn.0035.png\n"
              "  esvr-render smoke.esvr --bench --ref smoke.vdb   speed, memory, quality"};
}

// clang-format off
void addTransferOptions(cli::po::options_description& options) {
  options.add_options()
    ("grid,g", value<std::string>()->value_name("NAME"),
     "draw this grid; 'density[1]' is the second grid of that name (default: the first grid that "
     "can be drawn)")
    ("colors", value<std::string>()->value_name("MAP"),
     "color map, see the notes (default: viridis)")
    ("opacity", value<std::string>()->value_name("CURVE"),
     "opacity curve, see the notes (default: linear)")
    ("tf", value<std::string>()->value_name("FILE"),
     "read colors and opacities from a ParaView preset, in JSON or in the older XML; --opacity "
     "replaces the opacities of the file")
    ("preset", value<std::string>()->value_name("NAME"),
     "name of the preset in the file of --tf (default: the first preset)")
    ("tf-save", value<std::string>()->value_name("FILE.json"),
     "write the transfer function, over its range of values, as a ParaView preset")
    ("range", value<std::string>()->value_name("R")->default_value("auto"),
     "range of values that the transfer function covers: data (the range of the active voxels), "
     "auto (that range and the background), own (the range in the file of --tf), or LO,HI")
    ("opacity-length", value<double>()->value_name("L")->default_value(1.0),
     "length in voxels over which a constant value has the opacity of the curve; a larger length "
     "makes the volume more transparent");
}

void addPictureOptions(cli::po::options_description& options) {
  options.add_options()
    ("step", value<double>()->value_name("S")->default_value(1.0),
     "distance between the samples of a ray, in voxels")
    ("min-transmittance", value<double>()->value_name("T"),
     "end a ray when its transmittance falls below T (default: 1/4096; 0: never)")
    ("resolution", value<std::string>()->value_name("WxH")->default_value("800x800"),
     "width and height of the picture in pixels")
    ("background", value<std::string>()->value_name("R,G,B"),
     "color behind the volume, each channel from 0 to 1 (default: transparent)")
    ("bits", value<int>()->value_name("B")->default_value(8), "bits per channel of a PNG, 8 or 16")
    ("mode", value<std::string>()->value_name("M")->default_value("composite"),
     "composite: composite the samples of a ray from front to back; maximum or average: show the "
     "largest or the mean value of the samples")
    ("clip", value<std::string>()->value_name("BOX"),
     "draw only what lies in the box x0,y0,z0,x1,y1,z1")
    ("slice", value<std::string>()->value_name("A=P"),
     "draw only a slab of one voxel's thickness; 'z=12.5' is perpendicular to z, with its center "
     "at 12.5")
    ("depth", value<std::string>()->value_name("FILE.exr"),
     "also write, for each pixel, the distance in voxels at which half of the light is absorbed");
}

void addCameraOptions(cli::po::options_description& options) {
  options.add_options()
    ("camera", value<std::string>()->value_name("CAM.json"),
     "read the camera from a file; the options below replace values of the file")
    ("eye", value<std::string>()->value_name("X,Y,Z"), "position of the camera")
    ("center", value<std::string>()->value_name("X,Y,Z"), "point that the camera looks at")
    ("up", value<std::string>()->value_name("X,Y,Z"),
     "direction that points upwards in the picture (default: y)")
    ("fov", value<double>()->value_name("DEGREES"),
     "angle between the lower and the upper edge of the picture (default: 30)")
    ("orthographic", bool_switch(), "use parallel rays")
    ("height", value<double>()->value_name("H"),
     "height of an orthographic picture in voxels")
    ("turntable", value<int>()->value_name("N"),
     "draw N pictures of a full turn about the up axis")
    ("frames", value<std::string>()->value_name("A-B"),
     "draw only the pictures A to B of a turntable, counted from 0");
}

void addDeviceOptions(cli::po::options_description& options) {
  options.add_options()
    ("device", value<std::string>()->value_name("D")->default_value("auto"),
     "auto (a GPU if one is usable), cpu, cuda or cuda:N")
    ("max-vram", value<double>()->value_name("GB"),
     "GPU memory to use; if it is small, large pictures are drawn in bands (default: all free "
     "memory)")
    ("bins", value<int>()->value_name("N"),
     "number of parts, 1 to 16, into which a GPU divides the depth of the scene to draw them in "
     "parallel (default: chosen from the first picture)")
    ("method", value<std::string>()->value_name("M")->default_value("ellipsoids"),
     "ellipsoids: draw the ellipsoids of an .esvr file directly; bricks: decode all voxels once "
     "and draw them; auto: try both and take the faster one that fits into memory")
    ("between", value<std::string>()->value_name("B")->default_value("auto"),
     "voxels: between voxels, interpolate the decoded voxels; sum: evaluate the sum of ellipsoids "
     "itself, which is faster where a pixel covers many voxels, but less accurate unless the file "
     "was made with --fit-for drawing; auto: sum for such a file, otherwise voxels")
    ("values", value<std::string>()->value_name("T"),
     "draw voxels from a NanoVDB grid of this type: float, fp4, fp8, fp16 or fpn");
}

void addMeasuringOptions(cli::po::options_description& options) {
  options.add_options()
    ("ref", value<std::string>()->value_name("FILE"),
     "compare each picture with a picture of this VDB")
    ("sheet", value<std::string>()->value_name("FILE.png"),
     "write the picture, the picture of --ref and their error side by side")
    ("bench", bool_switch(),
     "measure the speed over 720 views of a full turn, or as many as --turntable says")
    ("report", value<std::string>()->value_name("FILE.json"),
     "write the results of --bench or --ref; '-' is the standard output")
    ("force,f", bool_switch(), "replace OUT.png if it exists");
}
// clang-format on

cli::CommandLine commandLine() {
  cli::CommandLine line(programText());
  line.argument("input", "IN");
  line.optionalArgument("output", "OUT.png");
  addTransferOptions(line.options());
  addPictureOptions(line.options());
  addCameraOptions(line.options());
  addDeviceOptions(line.options());
  addMeasuringOptions(line.options());
  cli::addMaxMemory(line);
  return line;
}

Vec3 vectorOf(const std::string& option, const std::string& text) {
  const auto v = cli::parseNumbers(option, text, 3);
  return {v[0], v[1], v[2]};
}
std::optional<Vec3> findVector(const Arguments& a, const std::string& option) {
  const auto text = a.find<std::string>(option);
  return text ? std::optional(vectorOf(option, *text)) : std::nullopt;
}

Resolution resolutionOf(const std::string& text) {
  const auto refuse = [&] {
    throw UsageError("--resolution must be WIDTHxHEIGHT, each from 1 to " +
                     std::to_string(kMaxSide) + ", not '" + text + "'");
  };
  Resolution r;
  const char* const end = text.data() + text.size();
  const auto width = std::from_chars(text.data(), end, r.width);
  if (width.ec != std::errc{} || width.ptr == end || *width.ptr != 'x') refuse();
  const auto height = std::from_chars(width.ptr + 1, end, r.height);
  if (height.ec != std::errc{} || height.ptr != end) refuse();
  if (r.width < 1 || r.width > kMaxSide || r.height < 1 || r.height > kMaxSide) refuse();
  return r;
}

CameraWish cameraOf(const Arguments& a) {
  const auto file = a.find<std::string>("camera");
  CameraWish wish = file ? readCamera(*file) : CameraWish{};
  const auto replace = [](auto& wished, auto given) {
    if (given) wished = given;
  };
  replace(wish.eye, findVector(a, "eye"));
  replace(wish.center, findVector(a, "center"));
  replace(wish.up, findVector(a, "up"));
  replace(wish.fov, a.find<double>("fov"));
  replace(wish.height, a.find<double>("height"));
  if (a.get<bool>("orthographic")) wish.projection = Projection::kOrthographic;
  const bool orthographic = wish.projection == Projection::kOrthographic;
  if (wish.height && !orthographic)
    throw UsageError("--height says nothing without --orthographic");
  if (wish.fov && orthographic)
    throw UsageError("--fov says nothing with --orthographic; --height does");
  return wish;
}

TransferFunction transferOf(const Arguments& a) {
  const auto file = a.find<std::string>("tf");
  const auto opacity = a.find<std::string>("opacity");
  if (!file && a.has("preset")) throw UsageError("--preset says nothing without --tf");
  if (!file)
    return {builtInColorMap(a.find<std::string>("colors").value_or("viridis")),
            builtInOpacity(opacity.value_or("linear"))};
  if (a.has("colors")) throw UsageError("--tf and --colors are two color maps; give one");
  auto f = readParaViewPreset(*file, a.find<std::string>("preset").value_or(""));
  if (!opacity) return f;
  const auto& points = f.colors.points;
  f.opacity = builtInOpacity(*opacity);
  for (auto& p : f.opacity) p.x = points.front().x + p.x * (points.back().x - points.front().x);
  return f;
}

void readRange(const Arguments& a, Options& options) {
  const auto& text = a.get<std::string>("range");
  if (text == "auto")
    options.rangeKind = RangeKind::kAuto;
  else if (text == "data")
    options.rangeKind = RangeKind::kData;
  else if (text == "own")
    options.rangeKind = RangeKind::kOwn;
  else {
    const auto v = cli::parseNumbers("range", text, 2);
    if (v[0] > v[1]) throw UsageError("--range must have LO <= HI, not '" + text + "'");
    options.rangeKind = RangeKind::kGiven;
    options.range = {float(v[0]), float(v[1])};
  }
}

std::optional<Rgb> backgroundOf(const Arguments& a) {
  const auto color = findVector(a, "background");
  if (!color) return std::nullopt;
  for (const double channel : *color) cli::requireRange("background", channel, 0.0, 1.0);
  return Rgb{(*color)[0], (*color)[1], (*color)[2]};
}

constexpr double kEverywhere = 1e9;  // voxels; larger than any coordinate in a grid

PlaceBox sliceOf(const std::string& text) {
  const std::string axes = "xyz";
  const auto axis = text.size() > 2 && text[1] == '=' ? axes.find(text[0]) : std::string::npos;
  if (axis == std::string::npos)
    throw UsageError("--slice must be like z=12.5, not '" + text + "'");
  const double place = cli::parseNumbers("slice", text.substr(2), 1)[0];
  PlaceBox box{{-kEverywhere, -kEverywhere, -kEverywhere}, {kEverywhere, kEverywhere, kEverywhere}};
  box.low[axis] = place - 0.5, box.high[axis] = place + 0.5;
  return box;
}

std::optional<PlaceBox> clipOf(const Arguments& a) {
  const auto clip = a.find<std::string>("clip"), slice = a.find<std::string>("slice");
  if (clip && slice) throw UsageError("--clip and --slice cannot be given together");
  if (slice) return sliceOf(*slice);
  if (!clip) return std::nullopt;
  const auto v = cli::parseNumbers("clip", *clip, 6);
  return PlaceBox{{v[0], v[1], v[2]}, {v[3], v[4], v[5]}};
}

void readFrames(const Arguments& a, Options& options) {
  const auto text = a.find<std::string>("frames");
  if (!text) return;
  if (options.turntable == 0) throw UsageError("--frames needs --turntable");
  const auto dash = text->find('-');
  if (dash == std::string::npos || dash == 0)
    throw UsageError("--frames must be like 0-35, not '" + *text + "'");
  const auto first = cli::parseNumbers("frames", text->substr(0, dash), 1)[0];
  const auto last = cli::parseNumbers("frames", text->substr(dash + 1), 1)[0];
  const bool whole = first == double(int(first)) && last == double(int(last));
  if (!whole || !(first >= 0.0 && first <= last && last < options.turntable))
    throw UsageError("--frames must be two of the turntable's numbers, from 0 to " +
                     std::to_string(options.turntable - 1) + ", not '" + *text + "'");
  options.firstFrame = int(first), options.lastFrame = int(last);
}

int bitsOf(const Arguments& a) {
  const int bits = a.get<int>("bits");
  if (bits != 8 && bits != 16)
    throw UsageError("--bits must be 8 or 16, not " + std::to_string(bits));
  return bits;
}

RenderMode modeOf(const Arguments& a) {
  return cli::choose<RenderMode>("mode", a.get<std::string>("mode"),
                                 {{"composite", RenderMode::kComposite},
                                  {"maximum", RenderMode::kMaximum},
                                  {"average", RenderMode::kAverage}});
}

int turntableOf(const Arguments& a) {
  const auto frames = a.find<int>("turntable");
  if (frames) cli::requireRange("turntable", *frames, 1, kMaxFrames);
  return frames.value_or(0);
}

std::optional<NanoValues> valuesOf(const Arguments& a) {
  const auto word = a.find<std::string>("values");
  if (!word) return std::nullopt;
  return cli::choose<NanoValues>("values", *word,
                                 {{"float", NanoValues::kFloat},
                                  {"fp4", NanoValues::kFp4},
                                  {"fp8", NanoValues::kFp8},
                                  {"fp16", NanoValues::kFp16},
                                  {"fpn", NanoValues::kFpN}});
}

RendererLimits limitsOf(const Arguments& a) {
  RendererLimits limits;
  if (const auto bins = a.find<int>("bins")) {
    cli::requireRange("bins", *bins, 1, kMaxBins);
    limits.depthParts = *bins;
  }
  if (const auto gigabytes = a.find<double>("max-vram")) {
    cli::requireRange("max-vram", *gigabytes, kMinVram, kMaxVram);
    limits.maxBytes = std::uint64_t(*gigabytes * 1e9);
  }
  return limits;
}

void readTransfer(const Arguments& a, Options& options) {
  options.transfer = transferOf(a);
  readRange(a, options);
  options.opacityLength = a.get<double>("opacity-length");
  cli::requireRange("opacity-length", options.opacityLength, 1e-6, 1e6);
  options.saveTransfer = a.find<std::string>("tf-save").value_or("");
}

void readPicture(const Arguments& a, Options& options) {
  options.camera = cameraOf(a);
  options.resolution = resolutionOf(a.get<std::string>("resolution"));
  options.step = a.get<double>("step");
  cli::requireRange("step", options.step, kMinStep, 1e6);
  options.minTransmittance = a.find<double>("min-transmittance");
  options.background = backgroundOf(a);
  options.bits = bitsOf(a);
  options.mode = modeOf(a);
  options.clip = clipOf(a);
  options.turntable = turntableOf(a);
  readFrames(a, options);
  options.depth = a.find<std::string>("depth").value_or("");
}

void readDevice(const Arguments& a, Options& options) {
  options.device = a.get<std::string>("device");
  options.limits = limitsOf(a);
  options.values = valuesOf(a);
  options.method = cli::choose<Method>(
      "method", a.get<std::string>("method"),
      {{"ellipsoids", Method::kEllipsoids}, {"bricks", Method::kBricks}, {"auto", Method::kAuto}});
  options.between = cli::choose<std::optional<Between>>(
      "between", a.get<std::string>("between"),
      {{"auto", std::nullopt}, {"voxels", Between::kVoxels}, {"sum", Between::kSum}});
}

void readMeasuring(const Arguments& a, Options& options) {
  options.reference = a.find<std::string>("ref").value_or("");
  options.sheet = a.find<std::string>("sheet").value_or("");
  options.bench = a.get<bool>("bench");
  if (!options.sheet.empty() && (options.reference.empty() || options.bench))
    throw UsageError("--sheet needs --ref, and cannot be given with --bench");
  options.report = a.find<std::string>("report").value_or("");
  if (options.bench && !options.depth.empty())
    throw UsageError("--bench writes no picture; leave --depth out");
  if (options.bench != options.output.empty())
    throw UsageError(options.bench ? "--bench writes no picture; leave OUT.png out"
                                   : "OUT.png is missing");
  if (!options.report.empty() && !options.bench && options.reference.empty())
    throw UsageError("--report writes the results of --bench or --ref; give one of them");
}

}  // namespace

std::optional<Options> parseOptions(int argc, const char* const* argv) {
  const auto arguments = commandLine().parse(argc, argv);
  if (!arguments) return std::nullopt;
  const Arguments& a = *arguments;
  Options options;
  options.input = a.get<std::string>("input");
  options.output = a.find<std::string>("output").value_or("");
  options.grid = a.find<std::string>("grid");
  readTransfer(a, options);
  readPicture(a, options);
  readDevice(a, options);
  readMeasuring(a, options);
  options.overwrite = a.get<bool>("force");
  options.maxMemory = cli::maxMemoryOf(a);
  options.threads = a.threads;
  options.verbosity = a.verbosity;
  options.commandLine.assign(argv, argv + argc);
  return options;
}

}  // namespace esvr::render
