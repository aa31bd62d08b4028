#pragma once
/// The main functions of vdb2esvr after its options are read: of a file (run.cpp), and of a sequence of files, one for
/// each frame (run_sequence.cpp).

#include <functional>

#include "esvr/container.h"
#include "esvr/device.h"
#include "esvr/workers.h"
#include "programs/run_main.h"
#include "vdb2esvr/options.h"
#include "vdb2esvr/records.h"

namespace esvr::vdb2esvr {

/// False if the options exclude ellipsoids, so that no device is needed.
[[nodiscard]] bool mayFit(const Options& options);

/// Finds the grids that options name, and chooses those that are fitted, carried and left out. A file
/// without grids is a valid frame of a sequence even if options name grids, because simulations often
/// begin so.
/// \throws BadInput, UsageError  as for resolveNames and chooseGrids
[[nodiscard]] GridChoice chooseFor(Options& options, const VdbSummary& input);

/// A hash of what decides the result of a conversion beside its input.
[[nodiscard]] std::uint64_t hashOfOrigin(const Options& options);

/// Stores the converted file and returns a summary of its sections.
using StoreFile = std::function<EsvrSummary(const EsvrFile&)>;

/// Writes the file to Options::output. The options must outlive the result.
[[nodiscard]] StoreFile writingTo(const Options& options);

/// The surroundings of a conversion.
struct FileRun {
  Ranks* ranks = nullptr;  ///< the processes that fit the parts together; may be null
  const CancelToken& cancel;
  const cli::Log& log;
  const StoreFile& store;
};

/// Reads, fits, stores and measures the grids of a file.
/// \throws Error  any error of its parts; RuntimeFailure if it was cancelled and stores no file
[[nodiscard]] RunRecord convertFile(const Options& options, const FileRun& run);

/// Reads, fits and measures the grids, writes the file and the report, and prints the summary.
/// \param ranks  the processes that fit the parts together; may be null
/// \return 0
/// \throws Error  any error of its parts; TargetMissed and RuntimeFailure (interrupted) may be
///                thrown after the file was written
int run(const Options& options, Ranks* ranks);

/// Frames of a group with an input each. A reader decodes at most one group to get at a frame, and
/// --resume loses at most the groups that were not complete. Groups of 24 frames would save 3 % of the
/// bytes of a fire, and one group 6 % (docs/lab-notes.md).
inline constexpr std::size_t kGroupFrames = 16;

/// Converts the frames, writes the report and prints the summary. Each frame is converted as a file
/// of its own: its output has the same bytes whatever other frames there are, and on any number of
/// threads.
/// \param ranks  must be null
/// \return 0
/// \throws Error  the kind of the first frame that failed; TargetMissed if frames missed the PSNR;
///                RuntimeFailure if the run was interrupted. All of them may be thrown after frames
///                were written
int runSequence(const Options& options, const Ranks* ranks);

}  // namespace esvr::vdb2esvr
