// The command line of esvr-render: the text of --help, the options by subject, and what they
// exclude. For each subject, one function adds the options and one reads them.

#include "render/options.h"

#include <algorithm>
#include <charconv>
#include <iterator>

#include "esvr/error.h"
#include "esvr/transfer_function.h"
#include "programs/command_line.h"
#include "programs/option_values.h"
#include "programs/video_file.h"
#include "render/camera_file.h"
#include "render/look.h"

namespace esvr::render {

using cli::Arguments;
using cli::po::bool_switch;
using cli::po::value;

// The text of --help.

namespace {

/// "title: one, two, three."
std::string listOf(const std::string& title, const std::vector<std::string>& names) {
  std::string text = title + ":";
  for (const std::string& name : names) text += " " + name + ",";
  text.back() = '.';
  return text;
}

std::string notes() {
  return "IN may be an .esvr, a .vdb or an .nvdb file. All are drawn with the same camera, "
         "samples, "
         "transfer function and compositing.\n"
         "\n" +
         listOf("Color maps", builtInColorMaps()) + " " +
         listOf("Opacity curves", builtInOpacities()) +
         "\n"
         "\n"
         "A turntable writes OUT.0000.png, OUT.0001.png and so on, and a sequence a picture of "
         "each "
         "frame. If OUT ends in .mp4 or .webm, the program ffmpeg, which must be in PATH, encodes "
         "a "
         "video.\n"
         "\n"
         "Exit codes: 0 done, 1 failure, 2 wrong options, 3 input that is damaged or cannot be "
         "used, 5 no such device or not enough memory (--max-memory, --max-vram).";
}

constexpr const char* kDetails =
    "IN may be - for standard input, or a pipe. Voxels are interpolated trilinearly. The voxels of "
    "an .esvr file are decoded when a ray needs them, and kept for the next picture. All are "
    "decoded before the first picture if the file stores voxels, a residual or an active mask.\n"
    "\n"
    "A grid is drawn in its proportions in the world: positions and lengths of cameras and rays "
    "are "
    "in the axes of the world, from the place of voxel (0, 0, 0), in units of the shortest edge of "
    "a "
    "voxel. For cubes along the axes they are voxels. The transform of a frustum is not applied. "
    "Samples whose value is exactly the background are transparent. A level set is drawn as an "
    "opaque body, whose faces differ in brightness by their angle to the rays, unless --colors, "
    "--opacity, --tf, --range or --mode is given.\n"
    "\n"
    "By default the projected box of the active voxels takes 90 % of the picture's width or "
    "height, whichever is tighter. In a turntable, no picture exceeds this, and all pictures have "
    "the same scale. With --bench, the sphere around the box touches the edges.\n"
    "\n"
    "CAM.json has the values of the camera options: {\"eye\": [1, 2, 3], \"center\": [...], "
    "\"up\": [...], \"fov\": 30}, or \"height\" for an orthographic camera.\n"
    "\n"
    "%04d in the name of an output stands for the number of a picture. If OUT is a folder, or ends "
    "in '/', the pictures are OUT/frame.0000.png and so on. A video shows the background; the "
    "default is black.\n"
    "\n"
    "If IN.esvr holds a sequence, or IN is a pattern such as smoke.####.vdb, each frame becomes a "
    "picture with the number of the frame in place of the pattern in OUT, or a picture of the "
    "video. All have one camera and one range of values, which are those of all frames together.\n"
    "\n"
    "--legend shows the color of each value and, in a second column in front of a checkerboard, "
    "its opacity over --opacity-length. The unit is the text of the grid's metadata \"unit\" or "
    "\"units\". A fitted camera leaves room for the bar. It is not drawn into EXR pictures, and "
    "the errors of --ref are measured without it.\n"
    "\n"
    "--with draws further grids of IN, which must have the same transform, for example a "
    "temperature that glows within a density. Behind the NAME of a grid, ':' separates parts of "
    "its LOOK: colors=MAP (default: inferno), opacity=CURVE, tf=FILE, preset=NAME and range=R, as "
    "for the options of these names, and emission, with which the grid emits light but hides "
    "nothing. Where grids overlap, their extinctions add up. Voxels are drawn without levels of "
    "detail. --legend and --tf-save show the first grid. In a transparent PNG, light beyond the "
    "opacity raises alpha; an EXR file holds it as it is.\n"
    "\n"
    "--ref also draws the voxels of a VDB with the same camera, on the same device, and prints the "
    "error of each picture. OUT.error.png shows ten times the error. --bench draws a full turn, "
    "writes no picture, and reports the frames per second and the times of the parts of a frame; "
    "with --ref it does so for both files.\n"
    "\n"
    "A PNG file holds sRGB colors that are not premultiplied by alpha. An EXR file holds floats in "
    "linear light that are premultiplied. Both hold the command line in their metadata.";

cli::ProgramText programText() {
  return {
      .name = kProgram,
      .purpose =
          "Draws a picture of an .esvr file, or of a VDB for comparison, through a transfer "
          "function. The ellipsoids of an .esvr file are drawn directly, without decoding the "
          "whole grid to voxels first.",
      .usage =
          "  esvr-render IN.esvr OUT.png|OUT.exr [OPTION]...\n"
          "  esvr-render IN.vdb OUT.png|OUT.exr [OPTION]...\n"
          "  esvr-render IN.esvr|IN.####.vdb OUT.####.png|OUT.mp4 [--frames 1-100] [OPTION]...\n"
          "  esvr-render IN OUT.mp4|OUT.webm|FOLDER/ --turntable N [OPTION]...\n"
          "  esvr-render IN.esvr --bench [--ref IN.vdb] [--report FILE.json] [OPTION]...",
      .notes = notes(),
      .details = kDetails,
      .examples =
          "  esvr-render smoke.esvr smoke.png\n"
          "  esvr-render smoke.vdb reference.png              # the original, to compare\n"
          "  esvr-render smoke.esvr smoke.png --colors inferno --opacity-length 4\n"
          "  esvr-render smoke.esvr smoke.png --tf presets.json --preset Smoke\n"
          "  esvr-render fire.esvr fire.png --grid density --colors grayscale \\\n"
          "              --with temperature:colors=black-body:emission\n"
          "  esvr-render smoke.esvr turn.png --turntable 36   # turn.0000.png to turn.0035.png\n"
          "  esvr-render smoke.esvr turn.mp4 --turntable 120 --fps 24\n"
          "  esvr-render smoke.esvr 'out.####.png' --frames 1-100   # frames of a sequence\n"
          "  esvr-render smoke.esvr --bench --ref smoke.vdb   # speed, memory, quality"};
}

}  // namespace

// The camera, its turntable, and the frames.

namespace {

/// The three numbers of an option. \return nothing if the option was not given
/// \throws UsageError  the value does not consist of three finite numbers
std::optional<Vec3> findVector(const Arguments& arguments, const std::string& option) {
  const auto text = arguments.find<std::string>(option);
  if (!text) return std::nullopt;
  const auto v = cli::parseNumbers(option, *text, 3);
  return Vec3{v[0], v[1], v[2]};
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

/// \throws UsageError  --fps does not fit the output
void readFps(const Arguments& a, Options& options) {
  constexpr double kMinFps = 0.1, kMaxFps = 1000.0;
  if (!a.has("fps")) return;
  options.fps = a.get<double>("fps");
  cli::requireRange("fps", options.fps, kMinFps, kMaxFps);
  if (!report::isVideo(options.output))
    throw UsageError("--fps says nothing unless the output is a video (.mp4 or .webm)");
}

/// \throws UsageError  options say something that a video cannot do
void checkVideoOptions(const Arguments& a, const Options& options) {
  if (!report::isVideo(options.output)) return;
  if (options.turntable == 0 && !options.frames)
    throw UsageError("a video needs --turntable or a sequence");
  if (a.has("ref")) throw UsageError("--ref compares pictures; a video has no files for them");
  if (a.get<int>("bits") != 8) throw UsageError("a video has 8 bits per channel; leave --bits out");
}

/// The frames of a pattern that are drawn. \throws BadInput  one of them is missing
void readPattern(const Arguments& a, const cli::FramePattern& pattern, Options& options) {
  const cli::FrameListing listing = cli::framesOnDisk(pattern);
  const auto range = a.find<std::string>("frames");
  options.pattern = pattern;
  options.frames = range ? cli::parseFrames("frames", *range) : listing.frames;
  options.frameHint = listing.hint(range ? &*options.frames : nullptr);
  std::vector<cli::FrameNumber> missing;
  std::ranges::copy_if(*options.frames, std::back_inserter(missing), [&](cli::FrameNumber frame) {
    return !std::ranges::binary_search(listing.frames, frame);
  });
  std::ranges::sort(missing);
  if (!missing.empty())
    throw BadInput(pattern.text() + ": " +
                   cli::sentenceOn(missing, options.frames->size(), "are missing") +
                   (options.frameHint.empty() ? "" : "; " + options.frameHint));
}

/// Checks the options of an input that is a sequence.
void checkSequenceOptions(const Arguments& a, const Options& options) {
  for (const char* option : {"turntable", "ref", "bench", "report"})
    if (a.isGiven(option))
      throw UsageError("--" + std::string(option) + " cannot be combined with a sequence");
  for (const auto& output : {options.output.string(), a.find<std::string>("depth").value_or("")})
    if (!output.empty() && !report::isVideo(output) && !cli::FramePattern::in(output))
      throw UsageError("'" + output +
                       "' needs a pattern such as #### for the number of a frame in the name of "
                       "the file, because '" +
                       options.input.string() + "' is a sequence");
}

void readFrames(const Arguments& a, Options& options) {
  const auto text = a.find<std::string>("frames");
  if (auto stored = cli::framesInFile(options.input)) {
    options.frames = text ? cli::parseFrames("frames", *text) : std::move(*stored);
    return checkSequenceOptions(a, options);
  }
  if (const auto pattern = cli::FramePattern::ofInput(options.input.string())) {
    readPattern(a, *pattern, options);
    return checkSequenceOptions(a, options);
  }
  if (!text) return;
  if (options.turntable == 0) throw UsageError("--frames needs --turntable or a sequence");
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

void addCameraOptions(cli::po::options_description& options) {
  // clang-format off
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
     "draw N pictures of a full turn about the up axis, see the notes for their files")
    ("frames", value<std::string>()->value_name("A-B"),
     "draw only the pictures A to B of a turntable, counted from 0, or these frames of a sequence, "
     "for example 1-100x2")
    ("fps", value<double>()->value_name("F"),
     "pictures per second of a video (default: 30)");
  // clang-format on
}

void readCameraOptions(const Arguments& a, Options& options) {
  options.camera = cameraOf(a);
  if (const auto turntable = a.find<int>("turntable")) {
    constexpr int kMaxFrames = 9999;  // the number in a frame's file name has four digits
    cli::requireRange("turntable", *turntable, 1, kMaxFrames);
    options.turntable = *turntable;
  }
  readFrames(a, options);
  readFps(a, options);
  checkVideoOptions(a, options);
}

}  // namespace

// The rays, the part of the volume that they pass, and the picture's form.

namespace {

constexpr int kMaxSide = Resolution::kMaxSide;
constexpr double kMinStep = 1e-3;  // voxels

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

std::optional<Rgb> backgroundOf(const Arguments& a) {
  const auto color = findVector(a, "background");
  if (!color) return std::nullopt;
  for (const double channel : *color) cli::requireRange("background", channel, 0.0, 1.0);
  return Rgb{(*color)[0], (*color)[1], (*color)[2]};
}

PlaceBox sliceOf(const std::string& text) {
  const std::string axes = "xyz";
  const auto axis = text.size() > 2 && text[1] == '=' ? axes.find(text[0]) : std::string::npos;
  if (axis == std::string::npos)
    throw UsageError("--slice must be like z=12.5, not '" + text + "'");
  return sliceBox(axis, cli::parseNumbers("slice", text.substr(2), 1)[0]);
}

std::optional<PlaceBox> clipOf(const Arguments& a) {
  const auto clip = a.find<std::string>("clip"), slice = a.find<std::string>("slice");
  if (clip && slice) throw UsageError("--clip and --slice cannot be given together");
  if (slice) return sliceOf(*slice);
  if (!clip) return std::nullopt;
  const auto v = cli::parseNumbers("clip", *clip, 6);
  return PlaceBox{{v[0], v[1], v[2]}, {v[3], v[4], v[5]}};
}

std::optional<Shading> shadingOf(const Arguments& a, const Options& options) {
  const auto light = findVector(a, "light");
  if (!a.get<bool>("shade")) {
    if (light) throw UsageError("--light needs --shade");
    return std::nullopt;
  }
  if (options.mode != RenderMode::kComposite) throw UsageError("--shade needs --mode composite");
  Shading shading;
  shading.light = light;
  return shading;
}

void addPictureOptions(cli::po::options_description& options) {
  // clang-format off
  options.add_options()
    ("step", value<double>()->value_name("S")->default_value(1.0),
     "distance between the samples of a ray, in voxels")
    ("min-transmittance", value<double>()->value_name("T"),
     "end a ray when its transmittance falls below T (default: 1/4096; 0: never)")
    ("resolution", value<std::string>()->value_name("WxH")->default_value("800x800"),
     "width and height of the picture in pixels")
    ("background", value<std::string>()->value_name("R,G,B"),
     "color behind the volume, each channel from 0 to 1 (default: transparent)")
    ("legend", bool_switch(),
     "draw a color bar with the values, the name and the unit of the grid at the right edge, see "
     "the notes")
    ("bits", value<int>()->value_name("B")->default_value(8), "bits per channel of a PNG, 8 or 16")
    ("mode", value<std::string>()->value_name("M")->default_value("composite"),
     "composite: composite the samples of a ray from front to back; maximum or average: show the "
     "largest or the mean value of the samples")
    ("classification", value<std::string>()->value_name("C"),
     "pre: integrate the transfer function over the values from each sample of a ray to the next, "
     "which draws smooth surfaces; post: give each sample the color and opacity of its value, which "
     "leaves stripes where values change much within a step (default: pre; with --slice, post)")
    ("shade", bool_switch(),
     "shade surfaces by the gradient of the values, with one light above and to the left of the "
     "camera")
    ("light", value<std::string>()->value_name("X,Y,Z"),
     "direction to the light of --shade, in index space")
    ("lod", value<std::string>()->value_name("L"),
     "levels of detail. auto: where a pixel is wider than 6 voxels, draw voxels that are 2, 4, ... times "
     "as large at longer steps, which is faster, needs less memory and shows fewer stray pixels; off: draw "
     "the voxels everywhere (default: auto; with --slice, off)")
    ("clip", value<std::string>()->value_name("BOX"),
     "draw only what lies in the box x0,y0,z0,x1,y1,z1")
    ("slice", value<std::string>()->value_name("A=P"),
     "draw only a slab of one voxel's thickness; 'z=12.5' is perpendicular to z, with its center "
     "at 12.5")
    ("depth", value<std::string>()->value_name("FILE.exr"),
     "also write, for each pixel, the distance in voxels at which half of the light is absorbed");
  // clang-format on
}

void readPictureOptions(const Arguments& a, Options& options) {
  options.resolution = resolutionOf(a.get<std::string>("resolution"));
  options.step = a.get<double>("step");
  cli::requireRange("step", options.step, kMinStep, 1e6);
  options.minTransmittance = a.find<double>("min-transmittance");
  options.background = backgroundOf(a);
  options.legend = a.get<bool>("legend");
  if (options.legend && options.output.extension() == ".exr")
    throw UsageError(
        "--legend cannot be drawn into an EXR picture, whose pixels are data for "
        "other programs; write a PNG");
  options.bits = a.get<int>("bits");
  if (options.bits != 8 && options.bits != 16)
    throw UsageError("--bits must be 8 or 16, not " + std::to_string(options.bits));
  options.mode = cli::choose<RenderMode>("mode", a.get<std::string>("mode"),
                                         {{"composite", RenderMode::kComposite},
                                          {"maximum", RenderMode::kMaximum},
                                          {"average", RenderMode::kAverage}});
  // A slice is about one sample thick, so that its color shall be that of the sample's value; and
  // it is thinner than a voxel of a coarser level.
  const bool isSlice = a.has("slice");
  options.classification = cli::choose<Classification>(
      "classification", a.find<std::string>("classification").value_or(isSlice ? "post" : "pre"),
      {{"pre", Classification::kPreIntegrated}, {"post", Classification::kPost}});
  options.lod = cli::choose<LevelOfDetail>(
      "lod", a.find<std::string>("lod").value_or(isSlice ? "off" : "auto"),
      {{"auto", LevelOfDetail::kAuto}, {"off", LevelOfDetail::kOff}});
  options.shading = shadingOf(a, options);
  options.clip = clipOf(a);
  options.depth = a.find<std::string>("depth").value_or("");
}

}  // namespace

// The device and the method that draw.

namespace {

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
  if (const auto parts = a.find<int>("depth-parts")) {
    cli::requireRange("depth-parts", *parts, 1, RendererLimits::kMaxDepthParts);
    limits.depthParts = *parts;
  }
  if (const auto memory = a.find<std::string>("max-vram"))
    limits.maxBytes = cli::parseDeviceMemory("max-vram", *memory);
  return limits;
}

void addDeviceOptions(cli::po::options_description& options) {
  cli::addDevice(options);
  // clang-format off
  options.add_options()
    ("max-vram", value<std::string>()->value_name("BYTES"),
     "GPU memory to use, for example 4GB or 64MB; a number below 1000000 without a unit is one of GB; "
     "if it is small, voxels are decoded again when they are needed again, and "
     "large pictures are drawn in bands (default: all free memory)")
    ("depth-parts", value<int>()->value_name("N"),
     "with --between sum: number of parts, 1 to 16, into which a GPU divides the depth of the scene "
     "to draw them in parallel (default: chosen from the first picture)")
    ("between", value<std::string>()->value_name("B")->default_value("voxels"),
     "voxels: between voxels, interpolate the decoded voxels; sum: evaluate the sum of ellipsoids "
     "itself, which is faster where a pixel covers many voxels, but less accurate")
    ("values", value<std::string>()->value_name("T"),
     "draw voxels from a NanoVDB grid of this type: float, fp4, fp8, fp16 or fpn");
  // clang-format on
}

void readDeviceOptions(const Arguments& a, Options& options) {
  options.device = cli::deviceOf(a);
  options.limits = limitsOf(a);
  options.values = valuesOf(a);
  options.between = cli::choose<Between>("between", a.get<std::string>("between"),
                                         {{"voxels", Between::kVoxels}, {"sum", Between::kSum}});
  if (options.shading && options.values)
    throw UsageError("--shade cannot be drawn from a NanoVDB grid; leave --values out");
}

}  // namespace

// The transfer function and its range, and the further grids with theirs.

namespace {

/// Refuses what several grids in one picture do not have.
void checkSeveralGrids(const Options& options) {
  if (int(options.with.size()) >= kMostGrids)
    throw UsageError("--with can be given up to " + std::to_string(kMostGrids - 1) + " times");
  const auto refuse = [](bool given, const std::string& option) {
    if (given) throw UsageError(option + " cannot be given with --with");
  };
  refuse(options.mode != RenderMode::kComposite, "--mode maximum or average");
  refuse(options.shading.has_value(), "--shade");
  refuse(!options.depth.empty(), "--depth");
  refuse(options.values.has_value(), "--values");
  refuse(options.between == Between::kSum, "--between sum");
}

void addTransferOptions(cli::po::options_description& options) {
  // clang-format off
  options.add_options()
    ("colors", value<std::string>()->value_name("MAP"),
     "color map, see the notes (default: viridis; without this option, --opacity, --tf and --range, "
     "a level set is drawn as an opaque body)")
    ("opacity", value<std::string>()->value_name("CURVE"),
     "opacity curve, see the notes (default: linear, and higher for the small values of a fog "
     "volume whose largest ones are far above the others)")
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
     "makes the volume more transparent")
    ("with", value<std::vector<std::string>>()->composing()->value_name("NAME[:LOOK]"),
     "also draw this grid in the same picture, see --help expert; can be repeated");
  // clang-format on
}

void readTransferOptions(const Arguments& a, Options& options) {
  options.look = lookOf(
      {a.find<std::string>("colors"), a.find<std::string>("opacity"), a.find<std::string>("tf"),
       a.find<std::string>("preset"), a.get<std::string>("range")},
      kUsualColors);
  options.opacityLength = a.get<double>("opacity-length");
  cli::requireRange("opacity-length", options.opacityLength, 1e-6, 1e6);
  options.saveTransfer = a.find<std::string>("tf-save").value_or("");
  if (const auto texts = a.find<std::vector<std::string>>("with"))
    for (const std::string& text : *texts) options.with.push_back(furtherGridOf(text));
  if (!options.with.empty()) checkSeveralGrids(options);
}

}  // namespace

// Comparisons with a reference, and measurements of speed.

namespace {

constexpr int kMostSamples = 16;  // a mean of more rays does not differ in 8 bits

int samplesOf(const Arguments& a, const Options& options) {
  const int samples = a.get<int>("ref-supersample");
  cli::requireRange("ref-supersample", samples, 1, kMostSamples);
  const Resolution r = options.resolution;
  if (samples * std::max(r.width, r.height) > Resolution::kMaxSide)
    throw UsageError("--ref-supersample makes a picture with a side of more than " +
                     std::to_string(Resolution::kMaxSide) + " pixels");
  if (samples > 1 && options.reference.empty()) throw UsageError("--ref-supersample needs --ref");
  return samples;
}

void addMeasuringOptions(cli::po::options_description& options) {
  // clang-format off
  options.add_options()
    ("ref", value<std::string>()->value_name("FILE"),
     "compare each picture with a picture of this VDB")
    ("ref-supersample", value<int>()->value_name("N")->default_value(1),
     "draw the picture of --ref with N x N rays a pixel, and without levels of detail")
    ("sheet", value<std::string>()->value_name("FILE.png"),
     "write the picture, the picture of --ref and their error side by side")
    ("bench", bool_switch(),
     "measure the speed over 720 views of a full turn, or as many as --turntable says")
    ("report", value<std::string>()->value_name("FILE.json"),
     "write the results of --bench or --ref; '-' is the standard output");
  // clang-format on
}

void readMeasuringOptions(const Arguments& a, Options& options) {
  options.reference = a.find<std::string>("ref").value_or("");
  options.referenceSamples = samplesOf(a, options);
  options.sheet = a.find<std::string>("sheet").value_or("");
  options.bench = a.get<bool>("bench");
  if (!options.sheet.empty() && (options.reference.empty() || options.bench))
    throw UsageError("--sheet needs --ref, and cannot be given with --bench");
  options.report = a.find<std::string>("report").value_or("");
  if (options.bench && !options.depth.empty())
    throw UsageError("--bench writes no picture; leave --depth out");
  if (options.bench && options.legend)
    throw UsageError("--bench writes no picture; leave --legend out");
  if (options.bench != options.output.empty())
    throw UsageError(options.bench ? "--bench writes no picture; leave OUT.png out"
                                   : "OUT.png is missing");
  if (!options.report.empty() && !options.bench && options.reference.empty())
    throw UsageError("--report writes the results of --bench or --ref; give one of them");
}

}  // namespace

// The command line.

namespace {

cli::CommandLine commandLine() {
  cli::CommandLine line(programText());
  line.argument("input", "IN");
  line.optionalArgument("output", "OUT.png");
  line.volumeInputs({"input", "ref"});
  line.textInputs({"camera", "tf"});
  // clang-format off
  line.options().add_options()
    ("grid,g", value<std::string>()->value_name("NAME"),
     "draw this grid; 'density[1]' is the second grid of that name (default: the first grid that "
     "can be drawn)");
  // clang-format on
  addTransferOptions(line.options());
  addPictureOptions(line.options());
  addCameraOptions(line.options());
  addDeviceOptions(line.options());
  addMeasuringOptions(line.options());
  line.options().add_options()("force,f", bool_switch(), "replace OUT.png if it exists");
  cli::addHostMemory(line);
  line.mainOptions({"grid", "colors",     "opacity",    "tf",     "range",     "opacity-length",
                    "with", "resolution", "background", "legend", "mode",      "shade",
                    "clip", "camera",     "eye",        "center", "turntable", "frames",
                    "fps",  "device",     "ref",        "bench",  "force"});
  return line;
}

}  // namespace

std::optional<Options> parseOptions(int argc, const char* const* argv) {
  const auto arguments = commandLine().parse(argc, argv);
  if (!arguments) return std::nullopt;
  const cli::Arguments& a = *arguments;
  Options options;
  options.input = a.get<std::string>("input");
  options.inputs = a.inputs;
  options.output = a.find<std::string>("output").value_or("");
  options.grid = a.find<std::string>("grid");
  // Each group reads what groups before it have set.
  readCameraOptions(a, options);
  readPictureOptions(a, options);
  readDeviceOptions(a, options);
  readTransferOptions(a, options);
  readMeasuringOptions(a, options);
  options.overwrite = a.get<bool>("force");
  options.memory = cli::hostMemoryOf(a);
  options.threads = a.threads;
  options.verbosity = a.verbosity;
  options.commandLine.assign(argv, argv + argc);
  return options;
}

}  // namespace esvr::render
