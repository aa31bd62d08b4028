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
constexpr int kMaxFrames = 9999;   // four digits in a frame's name
constexpr double kMinStep = 1e-3;  // voxels
constexpr int kMaxBins = 16;
constexpr double kMinVram = 0.001, kMaxVram = 1e4;  // GB

cli::ProgramText programText() {
  return {.name = kProgram,
          .purpose =
              "Draws an .esvr file, or for comparison a VDB, through a transfer function. The\n"
              "ellipsoids of an .esvr are drawn as they are: no voxels are kept of them.",
          .usage =
              "  esvr-render IN.esvr OUT.png|OUT.exr [OPTION]...\n"
              "  esvr-render IN.vdb OUT.png|OUT.exr [OPTION]...\n"
              "  esvr-render IN.esvr --bench [--ref IN.vdb] [--report FILE.json] [OPTION]...",
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
              "grayscale, x-ray, black-body, smoke, ct-bone, ct-soft-tissue. Opacities: linear,\n"
              "inverse, tent, step; smoke, ct-bone, ct-soft-tissue for the maps of these names.\n"
              "CAM.json is what the camera options say: {\"eye\": [1, 2, 3], \"center\": [...],\n"
              "\"up\": [...], \"fov\": 30}, or \"height\" for an orthographic one.\n"
              "\n"
              "On a GPU, voxels are marched in a NanoVDB grid. --ref draws its voxels beside\n"
              "every picture, on the same device, and says how far apart the two are;\n"
              "OUT.error.png shows where, ten times as bright. --bench draws a full turn, keeps\n"
              "no picture and reports frames a second and where the time goes; with --ref, of\n"
              "both.\n"
              "\n"
              "A PNG has the colors of a screen, not premultiplied; an EXR has floats in linear\n"
              "light, premultiplied. Both have this command line in their metadata. Exit codes:\n"
              "0 done, 1 failure, 2 wrong options, 3 input that is damaged or cannot be used,\n"
              "5 device or memory.",
          .examples =
              "  esvr-render smoke.esvr --bench --ref smoke.vdb    speed, memory, quality\n"
              "  esvr-render smoke.esvr smoke.png\n"
              "  esvr-render smoke.vdb reference.png              the original, to compare\n"
              "  esvr-render smoke.esvr smoke.png --colors inferno --opacity-length 4\n"
              "  esvr-render smoke.esvr smoke.png --tf presets.json --preset Smoke\n"
              "  esvr-render smoke.esvr turn.png --turntable 36   to turn.0035.png"};
}

cli::CommandLine commandLine() {
  cli::CommandLine line(programText());
  line.argument("input", "IN");
  line.optionalArgument("output", "OUT.png");
  // clang-format off
  line.options().add_options()
    ("grid,g", value<std::string>()->value_name("NAME"),
     "draw this grid; 'density[1]' is the second of that name (default: the first that can be drawn)")
    ("colors", value<std::string>()->value_name("MAP"),
     "color map (default: viridis)")
    ("opacity", value<std::string>()->value_name("CURVE"),
     "opacity over the range (default: linear)")
    ("tf", value<std::string>()->value_name("FILE"),
     "colors and opacities from a ParaView preset, JSON or the XML of old; --opacity replaces the "
     "latter")
    ("preset", value<std::string>()->value_name("NAME"),
     "which preset of FILE (default: the first)")
    ("tf-save", value<std::string>()->value_name("FILE.json"),
     "write the transfer function, laid over its range, as a ParaView preset")
    ("range", value<std::string>()->value_name("R")->default_value("auto"),
     "values that the transfer function is laid over: data (the active voxels'), auto (these and "
     "the background), own (as FILE has them), or LO,HI")
    ("opacity-length", value<double>()->value_name("L")->default_value(1.0),
     "voxels that an opacity holds for: more makes the volume clearer")
    ("step", value<double>()->value_name("S")->default_value(1.0), "voxels between samples")
    ("min-transmittance", value<double>()->value_name("T"),
     "a ray ends where less than this part of the light behind shows (default: 1/4096; 0: never)")
    ("resolution", value<std::string>()->value_name("WxH")->default_value("800x800"), "pixels")
    ("background", value<std::string>()->value_name("R,G,B"),
     "0 to 1 each (default: a transparent picture)")
    ("bits", value<int>()->value_name("B")->default_value(8), "8 or 16 a channel of a PNG")
    ("mode", value<std::string>()->value_name("M")->default_value("composite"),
     "composite, or one value of a ray: maximum, average")
    ("clip", value<std::string>()->value_name("BOX"),
     "draw only what lies in x0,y0,z0,x1,y1,z1")
    ("slice", value<std::string>()->value_name("A=P"),
     "draw only a slab of one voxel: 'z=12.5' lies across z")
    ("depth", value<std::string>()->value_name("FILE.exr"),
     "write how far away half of the light is stopped, in voxels")
    ("camera", value<std::string>()->value_name("CAM.json"),
     "the camera; options of their own replace what it says")
    ("eye", value<std::string>()->value_name("X,Y,Z"), "where the camera is")
    ("center", value<std::string>()->value_name("X,Y,Z"), "what it looks at")
    ("up", value<std::string>()->value_name("X,Y,Z"), "upwards in the picture (default: y)")
    ("fov", value<double>()->value_name("DEGREES"), "angle from the lower to the upper edge (30)")
    ("orthographic", bool_switch(), "parallel rays")
    ("height", value<double>()->value_name("H"),
     "voxels from the lower to the upper edge of an orthographic picture")
    ("turntable", value<int>()->value_name("N"),
     "N pictures of a full turn about the up axis")
    ("device", value<std::string>()->value_name("D")->default_value("auto"),
     "auto (a GPU where there is one), cpu, cuda or cuda:N")
    ("max-vram", value<double>()->value_name("GB"),
     "GPU memory to use: less draws large pictures in bands (default: what is free)")
    ("bins", value<int>()->value_name("N"),
     "parts of the depth, 1 to 16, that a GPU draws at once (default: by the first picture's lists)")
    ("method", value<std::string>()->value_name("M")->default_value("ellipsoids"),
     "of an .esvr: ellipsoids; bricks, which draws its voxels, decoded once; or auto, whichever is "
     "faster for the first picture and fits")
    ("between", value<std::string>()->value_name("B")->default_value("voxels"),
     "what ellipsoids show between voxels: voxels, their trilinear interpolation; or sum, the sum "
     "of ellipsoids itself, faster where a pixel holds many voxels")
    ("values", value<std::string>()->value_name("T"),
     "march voxels in a NanoVDB grid of float, fp4, fp8, fp16 or fpn")
    ("ref", value<std::string>()->value_name("FILE"), "compare with the voxels of a VDB")
    ("sheet", value<std::string>()->value_name("FILE.png"),
     "write the picture, that of --ref and their error beside each other")
    ("bench", bool_switch(),
     "measure: 720 views of a full turn, or as many as --turntable says")
    ("report", value<std::string>()->value_name("FILE.json"),
     "what --bench or --ref found; '-' is the standard output")
    ("frames", value<std::string>()->value_name("A-B"),
     "of a turntable, only the pictures from number A to B")
    ("force,f", bool_switch(), "replace OUT.png if it exists");
  // clang-format on
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

constexpr double kEverywhere = 1e9;  // voxels; beyond any grid

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
  if (clip && slice) throw UsageError("--clip and --slice are two boxes; give one");
  if (slice) return sliceOf(*slice);
  if (!clip) return std::nullopt;
  const auto v = cli::parseNumbers("clip", *clip, 6);
  return PlaceBox{{v[0], v[1], v[2]}, {v[3], v[4], v[5]}};
}

void readFrames(const Arguments& a, Options& options) {
  const auto text = a.find<std::string>("frames");
  if (!text) return;
  if (options.turntable == 0) throw UsageError("--frames says nothing without --turntable");
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

void readMeasuring(const Arguments& a, Options& options) {
  options.reference = a.find<std::string>("ref").value_or("");
  options.sheet = a.find<std::string>("sheet").value_or("");
  options.bench = a.get<bool>("bench");
  if (!options.sheet.empty() && (options.reference.empty() || options.bench))
    throw UsageError("--sheet shows a picture beside that of --ref; give both");
  options.report = a.find<std::string>("report").value_or("");
  if (options.bench && !options.depth.empty())
    throw UsageError("--bench keeps no picture; leave --depth out");
  if (options.bench != options.output.empty())
    throw UsageError(options.bench ? "--bench keeps no picture; leave OUT.png out"
                                   : "OUT.png is missing");
  if (!options.report.empty() && !options.bench && options.reference.empty())
    throw UsageError("--report says what --bench or --ref found; give one of them");
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
  options.output = a.find<std::string>("output").value_or("");
  options.grid = a.find<std::string>("grid");
  options.transfer = transferOf(a);
  readRange(a, options);
  options.camera = cameraOf(a);
  options.resolution = resolutionOf(a.get<std::string>("resolution"));
  options.step = a.get<double>("step");
  cli::requireRange("step", options.step, kMinStep, 1e6);
  options.opacityLength = a.get<double>("opacity-length");
  cli::requireRange("opacity-length", options.opacityLength, 1e-6, 1e6);
  options.minTransmittance = a.find<double>("min-transmittance");
  options.background = backgroundOf(a);
  options.bits = bitsOf(a);
  options.mode = modeOf(a);
  options.clip = clipOf(a);
  options.turntable = turntableOf(a);
  readFrames(a, options);
  options.depth = a.find<std::string>("depth").value_or("");
  options.saveTransfer = a.find<std::string>("tf-save").value_or("");
  options.device = a.get<std::string>("device");
  options.limits = limitsOf(a);
  options.values = valuesOf(a);
  options.method = cli::choose<Method>(
      "method", a.get<std::string>("method"),
      {{"ellipsoids", Method::kEllipsoids}, {"bricks", Method::kBricks}, {"auto", Method::kAuto}});
  options.between = cli::choose<Between>("between", a.get<std::string>("between"),
                                         {{"voxels", Between::kVoxels}, {"sum", Between::kSum}});
  readMeasuring(a, options);
  options.overwrite = a.get<bool>("force");
  options.maxMemory = cli::maxMemoryOf(a);
  options.threads = a.threads;
  options.verbosity = a.verbosity;
  options.commandLine = joined(argc, argv);
  return options;
}

}  // namespace esvr::render
