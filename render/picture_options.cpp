#include "render/option_groups.h"

#include <charconv>

#include "cli/choice.h"
#include "cli/number_list.h"
#include "render/slice.h"
#include "render/vector_option.h"

namespace esvr::render {
namespace {

using cli::Arguments;
using cli::po::bool_switch;
using cli::po::value;

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

int bitsOf(const Arguments& a) {
  const int bits = a.get<int>("bits");
  if (bits != 8 && bits != 16)
    throw UsageError("--bits must be 8 or 16, not " + std::to_string(bits));
  return bits;
}

/// A slice is thinner than a voxel of a coarser level.
LevelOfDetail lodOf(const Arguments& a) {
  const auto word = a.find<std::string>("lod");
  return cli::choose<LevelOfDetail>("lod", word.value_or(a.has("slice") ? "off" : "auto"),
                                    {{"auto", LevelOfDetail::kAuto}, {"off", LevelOfDetail::kOff}});
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

bool legendOf(const Arguments& a, const Options& options) {
  const bool legend = a.get<bool>("legend");
  if (legend && options.output.extension() == ".exr")
    throw UsageError(
        "--legend cannot be drawn into an EXR picture, whose pixels are data for "
        "other programs; write a PNG");
  return legend;
}

RenderMode modeOf(const Arguments& a) {
  return cli::choose<RenderMode>("mode", a.get<std::string>("mode"),
                                 {{"composite", RenderMode::kComposite},
                                  {"maximum", RenderMode::kMaximum},
                                  {"average", RenderMode::kAverage}});
}

/// A slice is about one sample thick, so that its color shall be that of the sample's value.
Classification classificationOf(const Arguments& a) {
  const auto word = a.find<std::string>("classification");
  return cli::choose<Classification>(
      "classification", word.value_or(a.has("slice") ? "post" : "pre"),
      {{"pre", Classification::kPreIntegrated}, {"post", Classification::kPost}});
}

}  // namespace

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
     "levels of detail. auto: where a pixel is wider than 6 voxels, draw means of 2^3, 4^3, ... voxels "
     "at longer steps, which is faster, needs less memory and shows fewer stray pixels; off: draw "
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
  options.legend = legendOf(a, options);
  options.bits = bitsOf(a);
  options.mode = modeOf(a);
  options.classification = classificationOf(a);
  options.lod = lodOf(a);
  options.shading = shadingOf(a, options);
  options.clip = clipOf(a);
  options.depth = a.find<std::string>("depth").value_or("");
}

}  // namespace esvr::render
