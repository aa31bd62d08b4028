#include <iostream>

#include "cli/printable.h"
#include "esvr/container.h"
#include "esvr2vdb/jobs.h"

namespace esvr::esvr2vdb {

void check(const Options& options) {
  const std::string name = cli::printable(options.input.string());
  const auto notes = checkEsvr(options.input, {options.memory.maxBytes, options.memory.voxels});
  if (options.verbosity == cli::Verbosity::kQuiet) return;
  for (const auto& note : notes) std::cout << name << ": note: " << cli::printable(note) << '\n';
  std::cout << name << ": OK\n";
}

}  // namespace esvr::esvr2vdb
