#pragma once
/// Converts the frames of a sequence to one file.

#include <vector>

#include "cli/sequence.h"
#include "esvr/progress.h"
#include "vdb2esvr/options.h"
#include "vdb2esvr/sequence_record.h"

namespace esvr::vdb2esvr {

/// Converts the frames and appends them to the file in their order. The frames of a group are
/// converted one after the other, because they may refer to each other; several groups are
/// converted at the same time. If the run is interrupted or stops after a failure, the complete
/// groups stay in the partial file.
/// \param frames  by increasing numbers
/// \throws RuntimeFailure  the file cannot be written, or a partial file is there that must be
///                         neither continued nor replaced
/// \throws UsageError  the partial file to continue is that of a run with other options
[[nodiscard]] SequenceRecord convertGroups(const Options& options,
                                           const std::vector<cli::Frame>& frames,
                                           const CancelToken& cancel);

}  // namespace esvr::vdb2esvr
