#pragma once
/// The options of esvr2vdb.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "cli/host_memory.h"
#include "cli/log.h"
#include "cli/sequence.h"
#include "esvr/container.h"
#include "esvr/coord.h"
#include "esvr/grid_coding.h"
#include "esvr/vdb_io.h"

namespace esvr::esvr2vdb {

inline constexpr const char* kProgram = "esvr2vdb";

enum class Job { kConvert, kList, kCheck };

struct Options {
  Job job = Job::kConvert;
  std::filesystem::path input, output;
  cli::InputFiles inputs;
  /// The frames, if the input and the output are patterns. The reference is a pattern, too.
  std::optional<cli::Sequence> sequence;
  std::vector<std::string> grids;  ///< names of the grids; empty: all
  DecodeOptions decode;
  ReadPart part;                             ///< the part of the file that is read
  std::optional<std::size_t> maxEllipsoids;  ///< keep those of each grid with the largest weight
  WriteOptions write;
  std::optional<std::filesystem::path> reference;
  std::optional<Box> box;  ///< box of the PSNR against the reference
  cli::HostMemory memory;  ///< memory that input may take
  int threads = 0;         ///< number of threads; 0: all
  cli::Verbosity verbosity = cli::Verbosity::kNormal;
};

/// True if the whole file is wanted.
[[nodiscard]] bool readsAll(const Options& options);

/// \return nothing if --help or --version was printed
/// \throws UsageError  an option is invalid
[[nodiscard]] std::optional<Options> parseOptions(int argc, const char* const* argv);

}  // namespace esvr::esvr2vdb
