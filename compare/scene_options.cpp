#include "compare/scene_options.h"

#include "cli/byte_size.h"
#include "cli/device_option.h"
#include "cli/host_memory.h"
#include "compare/measure_options.h"

namespace esvr::compare {

using cli::po::value;

void addSceneOptions(cli::CommandLine& line) {
  line.argument("reference", "REF.vdb");
  line.repeatedArgument("candidates");
  line.volumeInputs({"reference", "candidates"});
  line.textInputs({"tf"});
  line.options().add_options()(
      "grid,g", value<std::string>()->value_name("NAME"),
      "grid to compare, in every file (default: the first grid with active voxels)");
  addMeasureOptions(line.options());
  // clang-format off
  line.options().add_options()
    ("max-dense", value<std::string>()->value_name("BYTES")->default_value("1GB"),
     "leave ZFP out if the box as an array of floats takes more than this");
  // clang-format on
  cli::addDevice(line.options(), "device for fits and pictures: ");
  cli::addHostMemory(line);
}

void readSceneOptions(const cli::Arguments& a, TableOptions& options) {
  options.inputs = a.inputs;
  options.reference = a.get<std::string>("reference");
  for (const auto& candidate :
       a.find<std::vector<std::string>>("candidates").value_or(std::vector<std::string>{}))
    options.candidates.emplace_back(candidate);
  options.grid = a.find<std::string>("grid");
  options.box = boxOption(a);
  options.peak = peakOption(a);
  options.maxDense = cli::parseByteSize("max-dense", a.get<std::string>("max-dense"));
  options.device = cli::deviceOf(a);
  options.memory = cli::hostMemoryOf(a);
  options.threads = a.threads;
  options.verbosity = a.verbosity;
}

}  // namespace esvr::compare
