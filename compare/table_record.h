#pragma once
/// What a table is made of.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "compare/gallery.h"
#include "compare/grid_file.h"
#include "esvr/metrics.h"

namespace esvr::compare {

/// Of several runs, in seconds.
struct Timing {
  double median = 0.0, min = 0.0, max = 0.0;
  int runs = 0;
};
/// \param seconds  at least one
[[nodiscard]] Timing timingOf(std::vector<double> seconds);

/// An attempt of the search that led to a row.
struct SearchStep {
  std::string setting;
  std::uint64_t bytes = 0;
  std::optional<double> psnr;
};

struct TableRow {
  std::string name;  ///< "NanoVDB FpN Zip"
  std::string
      group;  ///< "lossless", "quantised", "at 48214 bytes", "at 44.70 dB", "ESVR", "external"
  std::string setting{};  ///< as --row takes it; empty where the row is no baseline
  std::string command{};
  std::optional<std::uint64_t> bytes{};
  std::optional<VolumeMetrics> metrics{};
  std::optional<Timing> encode{}, decode{};
  std::optional<std::uint64_t> memory{};
  std::optional<double> fps{};
  std::optional<ImageFigures> images{};
  Shown shown{};                    ///< of `images`
  std::vector<TimedCurvePoint> curve{};  ///< of a fit
  bool fittedHere = false;          ///< so that `encode` is from voxels to file
  std::string note{};               ///< why there are no figures, or what to know of them
  std::vector<SearchStep> search{};
};

struct TableRecord {
  std::string grid;
  std::uint64_t referenceBytes = 0;  ///< of the reference's file
  std::optional<std::uint64_t> halfBlosc;
  Box box;
  double peak = 0.0;
  std::uint64_t activeVoxels = 0;
  std::vector<TableRow> rows;
  std::string referencePng{};                   ///< with pictures
  std::optional<ImageFigures> referenceCost{};  ///< with pictures, as Gallery has it
  std::string drawnOn{};                        ///< with pictures: the device's name
  bool interrupted = false;
};

}  // namespace esvr::compare
