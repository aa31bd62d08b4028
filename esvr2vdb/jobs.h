#pragma once
/// The jobs of esvr2vdb. Each throws an esvr::Error if it fails.

#include <iosfwd>

#include "cli/log.h"
#include "esvr/progress.h"
#include "esvr2vdb/options.h"

namespace esvr::esvr2vdb {

/// Writes the VDB. If there is a reference, prints the errors of the written grids.
void convert(const Options& options);

/// The same for one file whose paths were checked. \param out  gets the errors
/// \throws Cancelled  nothing was written
void convertFile(const Options& options, const CancelToken& cancel, const cli::Log& log,
                 std::ostream& out);

/// The same for the content of a file, which may be a frame of a sequence.
/// \throws Cancelled  nothing was written
void convertContent(const Options& options, const EsvrFile& file, const CancelToken& cancel,
                    const cli::Log& log, std::ostream& out);

/// The limits with which the input is read.
[[nodiscard]] ReadLimits limitsOf(const Options& options);

/// Writes a VDB for each frame of the sequence, on several threads.
/// \throws Error  the kind of the first frame that failed; RuntimeFailure if the run was
///                interrupted. Frames may have been written
void convertSequence(const Options& options);

/// Prints the grids of a file and, for an .esvr file, its sections. It evaluates no voxel.
void list(const Options& options);

/// Prints the frames of a file that holds a sequence.
void listSequence(const Options& options);

/// Prints a row for the file of each frame of a pattern.
/// \throws Error  the failure of the first file that cannot be read, after the others were listed
void listFrames(const Options& options, const cli::FramePattern& pattern);

/// Prints the grids of a .vdb or .nvdb file.
void listVdb(const Options& options);

/// Reads the whole file, or those of all frames of a pattern, and prints OK.
/// \throws BadInput  the file is damaged (the text says where, and names each frame that is lost)
void check(const Options& options);

}  // namespace esvr::esvr2vdb
