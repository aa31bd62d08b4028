#include "render/option_groups.h"

#include "cli/number_list.h"

namespace esvr::render {
namespace {

using cli::Arguments;
using cli::po::value;

std::optional<TransferFunction> transferOf(const Arguments& a) {
  const auto file = a.find<std::string>("tf");
  const auto opacity = a.find<std::string>("opacity");
  if (!file && a.has("preset")) throw UsageError("--preset says nothing without --tf");
  if (!file && !opacity && !a.has("colors")) return std::nullopt;
  if (!file)
    return TransferFunction{builtInColorMap(a.find<std::string>("colors").value_or(kUsualColors)),
                            builtInOpacity(opacity.value_or(kUsualOpacity))};
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
     "makes the volume more transparent");
  // clang-format on
}

void readTransferOptions(const Arguments& a, Options& options) {
  options.transfer = transferOf(a);
  readRange(a, options);
  options.opacityLength = a.get<double>("opacity-length");
  cli::requireRange("opacity-length", options.opacityLength, 1e-6, 1e6);
  options.saveTransfer = a.find<std::string>("tf-save").value_or("");
}

}  // namespace esvr::render
