#pragma once
/// What a run and a sequence say of themselves: the tables that they print (summary.cpp), and the JSON reports of
/// --report, which docs/report.md describes.

#include <iosfwd>
#include <nlohmann/json_fwd.hpp>

#include "esvr/error.h"
#include "vdb2esvr/options.h"
#include "vdb2esvr/records.h"

namespace esvr::vdb2esvr {

void printSummary(const Options& options, const RunRecord& record, std::ostream& out);

/// Prints a row for each frame, the range of PSNR of each grid, and the bytes in all.
void printSequence(const Options& options, const SequenceRecord& record, std::ostream& out);

/// The options that affect the conversion, with those of its speed (`asked` in the report).
[[nodiscard]] nlohmann::ordered_json askedJson(const Options& options);

[[nodiscard]] nlohmann::ordered_json makeReport(const Options& options, const RunRecord& record);

/// What a run of the paper's method used and did (paper.cpp).
[[nodiscard]] nlohmann::ordered_json paperJson(const PaperRecord& record);

/// True if the options want a report in a file.
[[nodiscard]] bool reportIsFile(const Options& options);

/// The report of a run that failed: its options and the error.
[[nodiscard]] nlohmann::ordered_json makeFailureReport(const Options& options, const Error& error);

/// The report of a frame from that of its conversion, without what all frames have in common.
[[nodiscard]] nlohmann::ordered_json frameReport(nlohmann::ordered_json conversion);

[[nodiscard]] nlohmann::ordered_json makeSequenceReport(const Options& options,
                                                        const SequenceRecord& record);

}  // namespace esvr::vdb2esvr
