#include "render/look_text.h"
#include "render/option_groups.h"

namespace esvr::render {
namespace {

using cli::Arguments;
using cli::po::value;
using Texts = std::vector<std::string>;

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

}  // namespace

void addTransferOptions(cli::po::options_description& options) {
  // clang-format off
  options.add_options()
    ("colors", value<std::string>()->value_name("MAP"),
     "color map, see the notes (default: viridis; without this option, --opacity, --tf and --range, "
     "a level set is drawn as an opaque body)")
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
     "makes the volume more transparent")
    ("with", value<Texts>()->composing()->value_name("NAME[:LOOK]"),
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
  for (const std::string& text : a.find<Texts>("with").value_or(Texts{}))
    options.with.push_back(furtherGridOf(text));
  if (!options.with.empty()) checkSeveralGrids(options);
}

}  // namespace esvr::render
