// Plan: the readers of what the library takes beside its own files get any bytes: OpenVDB and NanoVDB files, splats and
// transfer functions.

#include <cmath>
#include <cstdint>
#include <span>

#include "esvr/error.h"
#include "esvr/splats.h"
#include "esvr/transfer_function.h"
#include "esvr/vdb_io.h"
#include "esvr/volume.h"
#include "fuzz/fuzzer.h"

/// OpenVDB's tree loses a node if reading the node throws.
extern "C" const char* __lsan_default_suppressions() { return "leak:openvdb*readTopology"; }

namespace esvr::fuzz {
namespace {

constexpr std::uint64_t kMaxBytes = std::uint64_t{16} << 20;

void readGrids(const std::filesystem::path& path) {
  for (const GridSummary& grid : inspectVdb(path).grids) {
    if (!grid.isScalar) continue;
    try {
      const auto read =
          readGrid(path, grid.uniqueName,
                   {.nonFinite = NonFinite::kValue, .allowEmpty = true, .maxBytes = kMaxBytes});
      checkInvariants(read.volume);
    } catch (const BadInput&) {
    } catch (const MemoryExceeded&) {
    }
  }
}

/// Lists and reads any bytes as an OpenVDB and as a NanoVDB file, within a memory limit. A grid that
/// is read is a valid volume.
ESVR_FUZZER(vdb) {
  static InputFile file(".vdb");
  try {
    readGrids(file.write(data, size));
  } catch (const BadInput&) {
  } catch (const MemoryExceeded&) {
  }
  return 0;
}

void check(const Splats& splats) {
  for (std::size_t i = 0; i < splats.size(); ++i) {
    float square = 0.0f;
    for (const auto& q : splats.rotation) square += q[i] * q[i];
    bool isFinite =
        std::abs(square - 1.0f) < 1e-5f && splats.alpha[i] > 0.0f && splats.alpha[i] <= 1.0f;
    for (std::size_t a = 0; a < 3; ++a)
      isFinite =
          isFinite && std::isfinite(splats.center[a][i]) && std::isfinite(splats.logScale[a][i]);
    require(isFinite);
  }
}

/// Reads PLY files of splats and evaluates them. What is accepted has finite numbers and unit quaternions.
ESVR_FUZZER(splats) {
  try {
    const auto file =
        parseSplats(std::as_bytes(std::span(data, size)), "fuzz", {.maxBytes = kMaxBytes});
    check(file.scene.splats);
    require(file.scene.splats.size() + file.dropped() == file.inFile);
    const auto grids = makeSplatGrids(file.scene, {.voxelSize = 1.0, .maxBytes = kMaxBytes});
    for (const float v : grids.density.volume.values) require(std::isfinite(v));
  } catch (const Error&) {
  }
  return 0;
}

/// Reads ParaView presets in JSON and in XML. A preset that is accepted is a valid transfer
/// function.
ESVR_FUZZER(transfer) {
  static InputFile file(".json");
  try {
    const auto function = readParaViewPreset(file.write(data, size), "");
    checkTransferFunction(function);
    for (const double x : {-1e300, 0.0, 0.5, 1e300}) {
      (void)colorAt(function.colors, x);
      (void)opacityAt(function.opacity, x);
    }
  } catch (const BadInput&) {
  }
  return 0;
}

}  // namespace
}  // namespace esvr::fuzz
