#include "render/option_groups.h"

#include "cli/byte_size.h"
#include "cli/choice.h"
#include "cli/device_option.h"

namespace esvr::render {
namespace {

using cli::Arguments;
using cli::po::value;

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

}  // namespace

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

}  // namespace esvr::render
