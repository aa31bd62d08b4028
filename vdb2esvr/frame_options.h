#pragma once
/// The options of sequences: --frames, --missing, --on-error, --gop and --steadiness.

#include "cli/command_line.h"
#include "vdb2esvr/options.h"

namespace esvr::vdb2esvr {

void addFrameOptions(cli::po::options_description& options);

/// Reads the options. The goal, --resume and --force are read before. They may change the goal and
/// what an interrupted run keeps (Options::onCancel).
/// \throws UsageError  an option is invalid or contradicts another one
/// \throws BadInput  as for cli::readSequence
void readFrames(const cli::Arguments& a, Options& options);

}  // namespace esvr::vdb2esvr
