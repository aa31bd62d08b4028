#pragma once
/// The record of a run, from which the summary and the report are made.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "esvr/container.h"
#include "esvr/vdb_io.h"
#include "esvr/vector_metrics.h"
#include "vdb2esvr/choose_grids.h"
#include "vdb2esvr/convert.h"

namespace esvr::vdb2esvr {

/// A grid of vectors, whose components are three of the converted grids.
struct ConvertedVector {
  std::string uniqueName;                  ///< name in the input
  std::size_t place = 0;                   ///< place in the input
  std::string valueType;                   ///< OpenVDB's name in the input: "vec3s" or "vec3d"
  StoredVector stored;                     ///< its first component is an index of RunRecord::grids
  std::optional<VectorMetrics> metrics{};  ///< nothing if the run was interrupted
};

struct RunRecord {
  VdbSummary input;
  std::vector<NotFitted> carried;      ///< grids that the file holds unchanged
  std::vector<NotFitted> skipped;      ///< grids that the user left out
  std::vector<std::string> notFitted;  ///< grids that an interrupted run did not convert
  std::vector<ConvertedGrid> grids;
  std::vector<ConvertedVector> vectors;
  EsvrSummary output;
  std::uint64_t bytesSeparate = 0;  ///< of the file without sharing; 0: not known
  bool interrupted = false;
  double secondsWrite = 0.0, secondsTotal = 0.0;
};

/// The bytes of the grids in the input that the output holds, and the bytes of the output.
struct Ratio {
  std::uint64_t bytesIn = 0, bytesOut = 0;
  std::size_t grids = 0, gridsOfInput = 0;
  [[nodiscard]] bool wholeInput() const { return grids == gridsOfInput; }
  [[nodiscard]] double value() const { return double(bytesIn) / double(bytesOut); }
};

/// The grids that the output holds against the output; the whole file where it holds all.
[[nodiscard]] Ratio ratioOf(const RunRecord& record);

/// Number of a carried grid in the file, which EsvrSummary uses.
[[nodiscard]] std::size_t numberOfCarried(const RunRecord& record, std::size_t carried);

/// Bytes of a grid of vectors in the file, without those that are shared with an earlier section.
[[nodiscard]] std::uint64_t ownBytes(const EsvrSummary& file, const ConvertedVector& vector);

/// True where the file holds a section of this kind for the grid.
[[nodiscard]] bool hasSection(const EsvrSummary& file, std::size_t grid, const std::string& kind);

/// Bytes of a grid's sections of a kind.
[[nodiscard]] std::uint64_t bytesOf(const EsvrSummary& file, std::size_t grid,
                                    const std::string& kind);

/// The first grid below its wanted PSNR; null if all grids reach it.
[[nodiscard]] const ConvertedGrid* firstBelow(const RunRecord& record);

/// The exit code of the run.
[[nodiscard]] int exitCodeOf(const RunRecord& record);

}  // namespace esvr::vdb2esvr
