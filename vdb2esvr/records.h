#pragma once
/// The records of a run and of a sequence, and their summaries and reports.

#include <cstdint>
#include <iosfwd>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "esvr/container.h"
#include "esvr/error.h"
#include "esvr/metrics.h"
#include "esvr/vdb_io.h"
#include "programs/sequence.h"
#include "vdb2esvr/convert.h"
#include "vdb2esvr/options.h"

namespace esvr::vdb2esvr {

// A run.

/// A grid of vectors, whose components are three of the converted grids.
struct ConvertedVector {
  std::string uniqueName;                  ///< name in the input
  std::size_t place = 0;                   ///< place in the input
  std::string valueType;                   ///< OpenVDB's name in the input: "vec3s" or "vec3d"
  StoredVector stored;                     ///< its first component is an index of RunRecord::grids
  std::optional<VectorMetrics> metrics{};  ///< nothing if the run was interrupted
};

struct RunRecord {
  /// The input. For splats, it lists the grids that became of them, and has the size of their own file.
  VdbSummary input;
  bool isOfSplats = false;             ///< grids have no bytes of their own in the input
  std::vector<NotFitted> carried;      ///< grids that the file holds unchanged
  std::vector<NotFitted> skipped;      ///< grids that the user left out
  std::vector<std::string> notFitted;  ///< grids that an interrupted run did not convert
  std::vector<ConvertedGrid> grids;
  std::vector<ConvertedVector> vectors;
  EsvrSummary output;
  std::uint64_t bytesSeparate = 0;  ///< of the file without sharing; 0: not known
  bool interrupted = false;
  bool isTooLarge = false;   ///< ConvertedFile::isTooLarge
  double abovePreset = 0.0;  ///< ConvertedFile::abovePreset
  double secondsWrite = 0.0, secondsTotal = 0.0;
};

/// The bytes of the grids in the input that the output holds, and the bytes of the output.
struct Ratio {
  std::uint64_t bytesIn = 0, bytesOut = 0;
  std::size_t grids = 0, gridsOfInput = 0;
  [[nodiscard]] bool wholeInput() const { return grids == gridsOfInput; }
  [[nodiscard]] double value() const { return double(bytesIn) / double(bytesOut); }
};

/// The grids that the output holds against the output; the whole file where it holds all, or has splats.
[[nodiscard]] Ratio ratioOf(const RunRecord& record);

/// Number of a carried grid in the file, which EsvrSummary uses.
[[nodiscard]] std::size_t numberOfCarried(const RunRecord& record, std::size_t carried);

/// Bytes of a grid of vectors in the file, without those that are shared with an earlier section.
[[nodiscard]] std::uint64_t ownBytes(const EsvrSummary& file, const ConvertedVector& vector);

/// Bytes of a grid's sections of a kind.
[[nodiscard]] std::uint64_t bytesOf(const EsvrSummary& file, std::size_t grid,
                                    const std::string& kind);

/// The first grid below its wanted PSNR; null if all grids reach it.
[[nodiscard]] const ConvertedGrid* firstBelow(const RunRecord& record);

/// The exit code of the run.
[[nodiscard]] int exitCodeOf(const RunRecord& record);

// A sequence.

/// What became of a frame.
enum class FrameState {
  kNotBegun,
  kConverted,
  kHeld,         ///< its output is that of the frame before it
  kKept,         ///< its output was there already
  kMissing,      ///< it has no input, and was left out
  kInterrupted,  ///< the fit was interrupted; the output, if there is one, is not the best
  kFailed
};

/// The states as in reports: "not begun", "converted", ...
[[nodiscard]] const char* nameOf(FrameState state);

/// The figures of a grid in a frame.
struct FrameGrid {
  std::string name;
  std::size_t ellipsoids = 0;
  double psnrBox = 0.0, psnrActive = 0.0;  ///< dB
  std::optional<double> psnrT50{};         ///< TransmittancePsnr::psnr50
};

/// A grid of a frame that was not fitted.
struct NotFittedName {
  std::string name, why;
};

struct FrameRecord {
  cli::Frame frame;
  FrameState state = FrameState::kNotBegun;
  std::uint64_t bytesIn = 0, bytesOut = 0;  ///< of the grids in the output, and of the output
  std::vector<FrameGrid> grids{};
  std::vector<NotFittedName> carried{}, skipped{};
  double seconds = 0.0;
  bool missedPsnr = false;
  std::optional<std::size_t> group{};  ///< index of its group in a file for all frames
  bool gridsDiffer = false;            ///< it begins a group because its grids differ
  std::optional<Error> failure{};
  nlohmann::ordered_json report{};   ///< the frame's own report, if one is wanted
  std::vector<GridBefore> before{};  ///< FrameBefore::grids for the next frame of its group
  double abovePreset = 0.0;          ///< FrameBefore::abovePreset for it
};

/// The figures of a file for all frames.
struct FileFigures {
  std::size_t groups = 0;
  std::optional<std::uint64_t> bytes{};  ///< nothing if the file is not complete
};

struct SequenceRecord {
  std::vector<FrameRecord> frames;  ///< in the order in which they are named
  double seconds = 0.0;
  bool interrupted = false;
  std::optional<FileFigures> file{};  ///< nothing if each frame is a file
};

/// Takes the figures of a converted frame. They are small, so that a sequence may be long.
void takeFigures(const RunRecord& run, FrameRecord& frame);

/// The numbers of the frames in a state, increasing.
[[nodiscard]] std::vector<cli::FrameNumber> framesIn(FrameState state,
                                                     const SequenceRecord& record);

/// The ranges of a grid's PSNR over its frames.
struct GridRange {
  std::string name;
  std::size_t frames = 0;
  double lowestActive = 0.0, highestActive = 0.0;  ///< PSNR over the active voxels, dB
  double lowestBox = 0.0, highestBox = 0.0;        ///< PSNR over the box, dB
  /// TransmittancePsnr::psnr50 of the frames that have it; nothing if none has
  std::optional<double> lowestT50{}, highestT50{};
};

/// The ranges of all grids, in the order in which they first occur.
[[nodiscard]] std::vector<GridRange> gridRanges(const SequenceRecord& record);

/// The error that gives the exit code of a sequence that was interrupted, or in which frames failed
/// or missed the PSNR; nothing if all is well. Frames that failed count more than missed ones.
[[nodiscard]] std::optional<Error> whatIsAmiss(const SequenceRecord& record);

// What a run and a sequence say of themselves: the tables that they print (summary.cpp), and the JSON reports of --report,
// which docs/report.md describes (report.cpp).

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
