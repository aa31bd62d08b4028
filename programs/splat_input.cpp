#include "programs/splat_input.h"

#include <cerrno>
#include <cstdlib>
#include <limits>
#include <string>
#include <system_error>
#include <vector>

#include "core/atomic_file.h"
#include "esvr/error.h"
#include "programs/files.h"
#include "programs/option_values.h"

namespace esvr::cli {
namespace {

std::optional<double> aboveZero(const Arguments& arguments, const char* option) {
  const auto given = arguments.find<double>(option);
  if (given) requireRange(option, *given, std::numeric_limits<double>::min(), 1e30);
  return given;
}

/// Says that the usual size of voxels makes large grids, which nobody asked for.
void tellSize(const SplatFile& file, const SplatInput& input, const SplatGrids& grids,
              const Log& log) {
  constexpr std::uint64_t kMany = 16'000'000;
  if (input.voxelSize || file.scene.indexToWorld) return;
  const std::uint64_t active = activeVoxelCount(grids.density.volume);
  if (active > kMany)
    log.warning("the usual size of voxels, " + shortNumber(grids.voxelSize) + ", gives " +
                std::to_string(active / 1'000'000) +
                " million active voxels; --voxel-size takes a larger one");
}

void tellLeftOut(const SplatFile& file, const Log& log) {
  const auto number = [](std::uint64_t n) { return std::to_string(n); };
  log.detail(number(file.scene.splats.size()) + " of " + number(file.inFile) + " splats");
  if (file.dropped() > 0)
    log.warning("splats are left out: " + file.whyDropped(), number(file.dropped()));
  if (file.rounded > 0)
    log.detail(number(file.rounded) +
               " splats are thinner than a thousandth of their length, and were made as thick");
  if (file.hasHigherDegrees)
    log.detail(
        "colors that depend on the direction are left out; the mean over all directions is used");
}

}  // namespace

void addSplatInput(po::options_description& options, const char* voxelSize) {
  // clang-format off
  options.add_options()
    ("voxel-size", po::value<double>()->value_name("S"),
     voxelSize)
    ("density-scale", po::value<double>()->value_name("D"),
     "extinction of a density of 1 over a unit of the world, of splats that are written or read")
    ("up", po::value<std::string>()->value_name("A")->default_value("y"),
     "upward axis of the world, where splats are written or read: y or z; none for splats whose axes are those of "
     "the world");
  // clang-format on
}

SplatInput splatInputOf(const Arguments& arguments) {
  return {aboveZero(arguments, "voxel-size"), aboveZero(arguments, "density-scale"),
          choose<std::optional<UpAxis>>(
              "up", arguments.get<std::string>("up"),
              {{"y", UpAxis::kY}, {"z", UpAxis::kZ}, {"none", std::nullopt}})};
}

bool isSplatFile(const std::filesystem::path& path) { return path.extension() == ".ply"; }

SplatGrids readSplatGrids(const std::filesystem::path& path, const SplatInput& input,
                          const HostMemory& memory, const Log& log) {
  const SplatFile file = readSplats(path, {.maxBytes = memory.maxBytes, .up = input.up});
  tellLeftOut(file, log);
  SplatGrids grids = namingFile(path.string(), [&] {
    return makeSplatGrids(file.scene, {.voxelSize = input.voxelSize,
                                       .densityScale = input.densityScale,
                                       .maxBytes = memory.maxBytes,
                                       .memory = memory.voxels});
  });
  tellSize(file, input, grids, log);
  log.detail("voxels of the size " + shortNumber(grids.voxelSize) + ", in which an extinction of " +
             shortNumber(input.densityScale.value_or(file.scene.densityScale)) +
             " for a unit of the world is a density of 1");
  if (grids.thickened > 0)
    log.detail(std::to_string(grids.thickened) + " splats are thinner than voxels, and were made " +
               shortNumber(kThinnest) + " voxels thick");
  return grids;
}

SplatsAsVdb::SplatsAsVdb(const Source& source, const Log& log) {
  const SplatGrids grids = readSplatGrids(source.path, source.input, source.memory, log);
  std::string folder = (source.scratch / "esvr-splats-XXXXXX").string();
  if (!::mkdtemp(folder.data())) failAt("cannot write a file in ", source.scratch, errno);
  folder_ = folder;
  path_ = folder_ / source.path.filename().replace_extension(".vdb");
  showInputAs(path_, withNamesOfInputs(source.path.string()));
  std::vector<GridToWrite> written{&grids.density};
  if (grids.color) written.emplace_back(&*grids.color);
  try {
    namingFile(source.path.string(),
               [&] { writeGrids(path_, {}, written, {.maxBytes = source.memory.maxBytes}); });
  } catch (...) {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
    throw;
  }
}

SplatsAsVdb::~SplatsAsVdb() {
  std::error_code ignored;
  std::filesystem::remove_all(folder_, ignored);
}

}  // namespace esvr::cli
