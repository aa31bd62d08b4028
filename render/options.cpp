#include "render/options.h"

#include "cli/command_line.h"
#include "cli/host_memory.h"
#include "render/option_groups.h"
#include "render/program_text.h"

namespace esvr::render {
namespace {

using cli::po::bool_switch;
using cli::po::value;

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
