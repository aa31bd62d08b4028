#include "render/options.h"

#include <charconv>

#include "cli/command_line.h"
#include "cli/number_list.h"

namespace esvr::render {
namespace {

using cli::Arguments;
using cli::po::bool_switch;
using cli::po::value;

constexpr int kMaxSide = 16384;    // pixels
constexpr int kMaxFrames = 9999;   // four digits in a frame's name
constexpr double kMinStep = 1e-3;  // voxels

cli::ProgramText programText() {
  return {.name = kProgram,
          .purpose =
              "Draws an .esvr file, or for comparison a VDB, through a transfer function. The\n"
              "ellipsoids of an .esvr are sampled along each ray, without voxels in between.",
          .usage =
              "  esvr-render IN.esvr OUT.png [OPTION]...\n"
              "  esvr-render IN.vdb OUT.png [OPTION]...",
          .notes =
              "IN may be an .nvdb too. Both kinds are drawn with the same camera, samples,\n"
              "transfer function and compositing. Voxels are interpolated trilinearly, and so\n"
              "are those of an .esvr made with --lossless or --max-error.\n"
              "\n"
              "Places and lengths are in voxels of the grid's index space; its transform takes\n"
              "no part. By default the camera sees all active voxels. Space that is exactly\n"
              "the background is transparent.\n"
              "\n"
              "Color maps: viridis, inferno, magma, plasma, cividis, turbo, cool-to-warm,\n"
              "grayscale, x-ray, black-body. Opacities: linear, inverse, tent, step.\n"
              "\n"
              "OUT.png has 8 bits a channel and this command line in its metadata. Exit codes:\n"
              "0 done, 1 failure, 2 wrong options, 3 input that is damaged or cannot be used,\n"
              "5 memory.",
          .examples =
              "  esvr-render smoke.esvr smoke.png\n"
              "  esvr-render smoke.vdb reference.png              the original, to compare\n"
              "  esvr-render smoke.esvr smoke.png --colors inferno --opacity-length 4\n"
              "  esvr-render smoke.esvr smoke.png --tf presets.json --preset Smoke\n"
              "  esvr-render smoke.esvr turn.png --turntable 36   to turn.0035.png"};
}

cli::CommandLine commandLine() {
  cli::CommandLine line(programText());
  line.argument("input", "IN");
  line.argument("output", "OUT.png");
  // clang-format off
  line.options().add_options()
    ("grid,g", value<std::string>()->value_name("NAME"),
     "draw this grid; 'density[1]' is the second of that name (default: the first that can be drawn)")
    ("colors", value<std::string>()->value_name("MAP"),
     "color map (default: viridis)")
    ("opacity", value<std::string>()->value_name("CURVE"),
     "opacity over the range (default: linear)")
    ("tf", value<std::string>()->value_name("FILE.json"),
     "colors and opacities from a ParaView preset; --opacity replaces the latter")
    ("preset", value<std::string>()->value_name("NAME"),
     "which preset of FILE.json (default: the first)")
    ("range", value<std::string>()->value_name("R")->default_value("auto"),
     "values that the transfer function is laid over: data (the active voxels'), auto (these and "
     "the background), own (as FILE.json has them), or LO,HI")
    ("opacity-length", value<double>()->value_name("L")->default_value(1.0),
     "voxels that an opacity holds for: more makes the volume clearer")
    ("step", value<double>()->value_name("S")->default_value(1.0), "voxels between samples")
    ("resolution", value<std::string>()->value_name("WxH")->default_value("800x800"), "pixels")
    ("background", value<std::string>()->value_name("R,G,B"),
     "0 to 1 each (default: a transparent picture)")
    ("eye", value<std::string>()->value_name("X,Y,Z"), "where the camera is")
    ("center", value<std::string>()->value_name("X,Y,Z"), "what it looks at")
    ("up", value<std::string>()->value_name("X,Y,Z"), "upwards in the picture (default: y)")
    ("fov", value<double>()->value_name("DEGREES"), "angle from the lower to the upper edge (30)")
    ("orthographic", bool_switch(), "parallel rays")
    ("height", value<double>()->value_name("H"),
     "voxels from the lower to the upper edge of an orthographic picture")
    ("turntable", value<int>()->value_name("N"),
     "N pictures of a full turn about the up axis")
    ("force,f", bool_switch(), "replace OUT.png if it exists");
  // clang-format on
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
  CameraWish wish;
  wish.eye = findVector(a, "eye");
  wish.center = findVector(a, "center");
  wish.up = findVector(a, "up");
  wish.fov = a.find<double>("fov");
  wish.height = a.find<double>("height");
  if (a.get<bool>("orthographic")) wish.projection = Projection::kOrthographic;
  if (wish.height && !a.get<bool>("orthographic"))
    throw UsageError("--height says nothing without --orthographic");
  if (wish.fov && a.get<bool>("orthographic"))
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
    if (v[0] > v[1]) throw UsageError("--range must rise: '" + text + "'");
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

int turntableOf(const Arguments& a) {
  const auto frames = a.find<int>("turntable");
  if (frames) cli::requireRange("turntable", *frames, 1, kMaxFrames);
  return frames.value_or(0);
}

std::string joined(int argc, const char* const* argv) {
  std::string text = kProgram;
  for (int i = 1; i < argc; ++i) text += std::string(" ") + argv[i];
  return text;
}

}  // namespace

std::optional<Options> parseOptions(int argc, const char* const* argv) {
  const auto arguments = commandLine().parse(argc, argv);
  if (!arguments) return std::nullopt;
  const Arguments& a = *arguments;
  Options options;
  options.input = a.get<std::string>("input");
  options.output = a.get<std::string>("output");
  options.grid = a.find<std::string>("grid");
  options.transfer = transferOf(a);
  readRange(a, options);
  options.camera = cameraOf(a);
  options.resolution = resolutionOf(a.get<std::string>("resolution"));
  options.step = a.get<double>("step");
  cli::requireRange("step", options.step, kMinStep, 1e6);
  options.opacityLength = a.get<double>("opacity-length");
  cli::requireRange("opacity-length", options.opacityLength, 1e-6, 1e6);
  options.background = backgroundOf(a);
  options.turntable = turntableOf(a);
  options.overwrite = a.get<bool>("force");
  options.threads = a.threads;
  options.verbosity = a.verbosity;
  options.commandLine = joined(argc, argv);
  return options;
}

}  // namespace esvr::render
