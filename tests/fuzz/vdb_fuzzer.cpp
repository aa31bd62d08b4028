// Lists and reads any bytes as an OpenVDB and as a NanoVDB file, within a memory limit. A grid that
// is read is a valid volume.

#include <cstdint>

#include "esvr/error.h"
#include "esvr/vdb_io.h"
#include "esvr/volume.h"
#include "fuzz/input_file.h"

namespace {

using namespace esvr;

constexpr std::uint64_t kMaxBytes = std::uint64_t{16} << 20;

void readAll(const std::filesystem::path& path) {
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

}  // namespace

/// OpenVDB's tree loses a node if reading the node throws.
extern "C" const char* __lsan_default_suppressions() { return "leak:openvdb*readTopology"; }

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static fuzz::InputFile file(".vdb");
  try {
    readAll(file.write(data, size));
  } catch (const BadInput&) {
  } catch (const MemoryExceeded&) {
  }
  return 0;
}
