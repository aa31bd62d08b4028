#pragma once
/// The JSON report of a sequence, which docs/report.md describes.

#include "vdb2esvr/options.h"
#include "vdb2esvr/sequence_record.h"

namespace esvr::vdb2esvr {

/// The report of a frame from that of its conversion, without what all frames have in common.
[[nodiscard]] nlohmann::ordered_json frameReport(nlohmann::ordered_json conversion);

[[nodiscard]] nlohmann::ordered_json makeSequenceReport(const Options& options,
                                                        const SequenceRecord& record);

}  // namespace esvr::vdb2esvr
