// Writes a VDB from an .esvr file, and compares it with a reference; the resolution of the written grids (--coarsen,
// --voxel-size); and splats, which are written from a grid, and from which a VDB is written.

#include <algorithm>
#include <array>
#include <cstddef>
#include <filesystem>
#include <iosfwd>
#include <iostream>
#include <optional>
#include <ostream>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "esvr/container.h"
#include "esvr/encode.h"
#include "esvr/error.h"
#include "esvr/grid.h"
#include "esvr/metrics.h"
#include "esvr/resolution.h"
#include "esvr/splats.h"
#include "esvr/vdb_io.h"
#include "esvr2vdb/jobs.h"
#include "programs/files.h"
#include "programs/option_values.h"
#include "programs/run_main.h"
#include "programs/splat_input.h"

namespace esvr::esvr2vdb {

// Grids by their names.

std::vector<ListedGrid> listedGrids(const EsvrFile& file) {
  const GridNames names(namesInOrder(file));
  std::vector<ListedGrid> grids;
  for (const auto& grid : gridsInOrder(file))
    grids.push_back({grid, names.unique(grids.size()), grids.size()});
  return grids;
}

std::span<const StoredGrid> storedParts(const EsvrFile& file, const GridOfFile& grid) {
  const std::span all(file.grids);
  return grid.isVector ? all.subspan(file.vectors[grid.index].first, kComponents)
                       : all.subspan(grid.index, 1);
}

namespace {

/// The named grids in file order; all grids if none is named.
/// \param path  file name for error texts
/// \throws BadInput  a grid does not exist, or its name is ambiguous; the text lists the grids
std::vector<ListedGrid> chooseGrids(const std::filesystem::path& path, const EsvrFile& file,
                                    const std::vector<std::string>& wanted) {
  const auto all = listedGrids(file);
  if (wanted.empty()) return all;
  const GridNames names(namesInOrder(file));
  std::set<std::size_t> places;  // a set, so that a grid that is named twice is written once
  for (const auto& name : wanted) places.insert(names.findWhole(name, path));
  std::vector<ListedGrid> chosen;
  for (const std::size_t place : places) chosen.push_back(all[place]);
  return chosen;
}

// The option --reference.

/// A written grid and the grid of the reference that it is compared with.
struct ComparedGrid {
  std::string name;                                   ///< name in the .esvr file
  std::array<std::string, kComponents> components{};  ///< their names, for vectors
  std::size_t reference = 0;                          ///< place in the reference
  std::size_t written = 0;                            ///< place in the output
  bool isVector = false;
};

ReadOptions readingOf(const Options& options) {
  return {.nonFinite = NonFinite::kKeep,
          .maxBytes = options.memory.maxBytes,
          .memory = options.memory.voxels};
}

/// The two files of a comparison.
struct ComparedFiles {
  explicit ComparedFiles(const Options& chosen)
      : options(chosen),
        written(inspectVdb(chosen.output)),
        ofReference(inspectVdb(*chosen.reference).directory) {}

  const Options& options;
  VdbSummary written;
  std::shared_ptr<const vdb::ArchiveDirectory> ofReference;

  [[nodiscard]] ReadOptions reading(const std::filesystem::path& path) const {
    ReadOptions reading = readingOf(options);
    reading.directory = path == options.output ? written.directory : ofReference;
    return reading;
  }

  /// True if a written grid has no active voxel, which readGrid and readVector would refuse.
  [[nodiscard]] bool isEmpty(const ComparedGrid& grid) const {
    return written.grids.at(grid.written).activeVoxels == 0;
  }
};

VolumeMetrics compare(const ComparedFiles& files, const ComparedGrid& grid) {
  const Options& options = files.options;
  const auto read = [&](const auto& path, std::size_t place) {
    return readGrid(path, place, files.reading(path));
  };
  const VolumeGrid reference = read(*options.reference, grid.reference);
  const VolumeGrid written =
      files.isEmpty(grid) ? VolumeGrid{} : read(options.output, grid.written);
  return compareVolumes(
      reference.volume, written.volume,
      {.box = options.box,
       .ssim = true,
       .transmittance = isLookedThrough(reference.descriptor.gridClass, reference.volume),
       .narrowing = between(reference.narrowing, written.narrowing)});
}

VectorMetrics compareVectorGrid(const ComparedFiles& files, const ComparedGrid& grid) {
  const Options& options = files.options;
  const auto read = [&](const auto& path, std::size_t place) {
    return readVector(path, place, files.reading(path));
  };
  const VectorGrid reference = read(*options.reference, grid.reference);
  const VectorGrid written =
      files.isEmpty(grid) ? VectorGrid{} : read(options.output, grid.written);
  return compareVectors(reference.components, written.components,
                        {.box = options.box, .ssim = true},
                        between(reference.narrowing, written.narrowing));
}

std::vector<std::string> row(const std::string& name, const VolumeMetrics& m) {
  return {name,
          cli::decibels(m.psnrActive),
          cli::decibels(m.psnrBox),
          m.transmittance ? cli::decibels(m.transmittance->psnr50) : "-",
          cli::shortNumber(m.maxError),
          cli::shortNumber(m.p999Error),
          cli::shortNumber(*m.ssim),
          cli::shortNumber(m.iou),
          cli::shortNumber(m.massReference),
          cli::shortNumber(m.massCandidate)};
}

/// Adds a row, or for vectors one for their lengths and one for each component.
void addRows(const ComparedFiles& files, const ComparedGrid& grid, cli::Table& table) {
  if (!grid.isVector) return table.add(row(grid.name, compare(files, grid)));
  const VectorMetrics metrics = compareVectorGrid(files, grid);
  table.add(row(grid.name, metrics.magnitude));
  for (std::size_t c = 0; c < kComponents; ++c)
    table.add(row(grid.components[c], metrics.components[c]));
}

/// Compares the written grids with the reference and prints a table.
/// \throws BadInput, MemoryExceeded  as for readGrid
void printErrors(const Options& options, const std::vector<ComparedGrid>& grids,
                 std::ostream& out) {
  cli::Table table({"grid", "PSNR active", "PSNR box", "PSNR T 0.5", "max error", "p99.9 error",
                    "SSIM", "IoU", "mass ref", "mass"});
  const ComparedFiles files(options);
  for (const auto& grid : grids) addRows(files, grid, table);
  table.print(out);
}

// A file.

/// A grid that was decoded.
using DecodedGrid = std::variant<VolumeGrid, VectorGrid>;

/// Checks everything that can be checked before the work begins.
void checkFiles(const Options& options) {
  cli::requireSeparate(options.inputs.paths, {options.output});
  cli::checkOutput(options.output, {".vdb", ".nvdb", ".ply", ".usda"}, options.write.overwrite);
}

bool writesNano(const Options& options) { return options.output.extension() == ".nvdb"; }

/// Why the output cannot hold a grid; empty if it can.
std::string whyNot(const EsvrFile& file, const GridOfFile& grid, const Options& options) {
  if (!grid.isCarried) return "";
  if (changesResolution(options))
    return "it is carried unchanged, and has no voxels of another size";
  if (!readsAll(options)) return "--lod, --max-ellipsoids and --bbox cannot cut a carried grid";
  return writesNano(options) ? whyNotNano(&file.carried[grid.index]) : "";
}

/// Restricts what is read to the named grids. Only the records of the file are read for this.
void restrictToNamed(const Options& options, ReadPart& wanted) {
  wanted.grids.emplace();
  const EsvrFile file = readEsvrPart(options.input, wanted).file;
  for (const auto& [grid, name, place] : chooseGrids(options.input, file, options.grids)) {
    if (grid.isCarried) {
      wanted.carriedBytes = true;
      continue;
    }
    for (const StoredGrid& part : storedParts(file, grid))
      wanted.grids->push_back(std::size_t(&part - file.grids.data()));
  }
}

PartOfFile read(const Options& options, const cli::Log& log) {
  ReadPart wanted = options.part;
  wanted.limits = limitsOf(options);
  if (!options.grids.empty()) restrictToNamed(options, wanted);
  if (readsAll(options) && !wanted.grids) return {readEsvr(options.input, wanted.limits), {}, 0};
  PartOfFile part = readEsvrPart(options.input, wanted);
  // Small files are read once for the names of the grids, and once more for the grids.
  const std::uint64_t bytes = std::filesystem::file_size(options.input);
  if (part.bytesRead < bytes)
    log.info("read " + std::to_string(part.bytesRead) + " of " + std::to_string(bytes) + " bytes");
  return part;
}

/// The chosen grids that the output can hold. Says which of them are left out.
/// \throws UsageError  a grid that it cannot hold is named
/// \throws BadInput  no grid is left, or the file has none and the output needs one
std::vector<ListedGrid> writable(const EsvrFile& file, const std::vector<ListedGrid>& chosen,
                                 const Options& options, const cli::Log& log) {
  std::vector<ListedGrid> kept;
  for (const ListedGrid& grid : chosen) {
    const std::string why = whyNot(file, grid.grid, options);
    if (why.empty()) {
      kept.push_back(grid);
      continue;
    }
    const std::string text = "grid \"" + grid.name + "\" ";
    if (!options.grids.empty())
      throw UsageError(options.output.string() + ": " + text + "cannot be written: " + why);
    log.warning(text + "is left out: " + why);
  }
  if (kept.empty() && !chosen.empty())
    throw BadInput(options.input.string() + ": no grid is left to write");
  if (kept.empty() && writesNano(options))
    throw BadInput(options.input.string() +
                   " has no grid, and a .nvdb file cannot be without one; write a .vdb file");
  return kept;
}

/// True if a part of a grid's ellipsoids is wanted, which a frame of a sequence still has in full.
bool isCut(const Options& options) { return options.maxEllipsoids || options.part.layers; }

StoredGrid wantedPart(const StoredGrid& grid, const Options& options) {
  const StoredGrid part = options.part.layers ? firstLayers(grid, *options.part.layers) : grid;
  return options.maxEllipsoids ? heaviest(part, *options.maxEllipsoids) : part;
}

VolumeGrid decoded(const StoredGrid& grid, const Options& options, const DecodeOptions& decode) {
  const double factor = factorOf(options.resolution, grid.descriptor);
  return isCut(options) ? decodeAtResolution(wantedPart(grid, options), factor, decode)
                        : decodeAtResolution(grid, factor, decode);
}

VectorGrid decoded(const EsvrFile& file, const StoredVector& vector, const Options& options,
                   const DecodeOptions& decode) {
  const StoredComponents components = componentsOf(file, vector);
  const double factor = factorOf(options.resolution, components.front().descriptor);
  if (!isCut(options)) return decodeVectorAtResolution(vector.name, components, factor, decode);
  std::vector<StoredGrid> parts;
  for (const StoredGrid& component : components) parts.push_back(wantedPart(component, options));
  return decodeVectorAtResolution(vector.name, std::span(parts).first<kComponents>(), factor,
                                  decode);
}

/// Bytes of a volume in memory.
std::uint64_t bytesOf(const SparseVolume& volume) {
  const std::uint64_t values = volume.values.size() * sizeof(float);
  return volume.brickCount() * (sizeof(BrickMask) + sizeof(Coord)) +
         (memoryOf(volume).isInFile(values) ? 0 : values);
}

std::uint64_t bytesOf(const DecodedGrid& grid) {
  if (const auto* number = std::get_if<VolumeGrid>(&grid)) return bytesOf(number->volume);
  std::uint64_t bytes = 0;
  for (const auto& component : std::get<VectorGrid>(grid).components) bytes += bytesOf(component);
  return bytes;
}

std::uint64_t activeVoxelsOf(const DecodedGrid& grid) {
  if (const auto* number = std::get_if<VolumeGrid>(&grid)) return activeVoxelCount(number->volume);
  std::uint64_t voxels = 0;
  for (const auto& component : std::get<VectorGrid>(grid).components)
    voxels += activeVoxelCount(component);
  return voxels;
}

const GridDescriptor& descriptorOf(const DecodedGrid& grid) {
  return std::visit([](const auto& g) -> const GridDescriptor& { return g.descriptor; }, grid);
}

DecodedGrid decoded(const EsvrFile& file, const ListedGrid& named, const Options& options,
                    const DecodeOptions& decode) try {
  const std::size_t index = named.grid.index;
  if (named.grid.isVector) return decoded(file, file.vectors[index], options, decode);
  return decoded(file.grids[index], options, decode);
} catch (Error& error) {
  error.nameGrid(shownName(storedParts(file, named.grid).front().descriptor.name), named.name);
  throw;
}

/// The grids that are not carried, and the components of those of vectors.
std::vector<const StoredGrid*> storedGrids(const EsvrFile& file,
                                           const std::vector<ListedGrid>& chosen) {
  std::vector<const StoredGrid*> grids;
  for (const auto& [grid, name, place] : chosen) {
    if (grid.isCarried) continue;
    for (const StoredGrid& part : storedParts(file, grid)) grids.push_back(&part);
  }
  return grids;
}

/// How grids are decoded beside the content of the file.
DecodeOptions decodingOf(const EsvrFile& file, const Options& options) {
  DecodeOptions decode = options.decode;
  decode.maxBytes = options.memory.maxBytes - std::min(options.memory.maxBytes, contentBytes(file));
  decode.memory = options.memory.voxels;
  return decode;
}

/// Whether carried grids get coarser voxels. With finer ones, voxels have no values between them.
bool coarsensCarried(const Options& options, const EsvrFile& file) {
  const Resolution& wish = options.resolution;
  if (file.carried.empty() || !readsAll(options)) return false;
  if (!wish.voxelSize) return wish.isAuto || wish.factor > 1.0;
  return !file.grids.empty() && std::ranges::all_of(file.grids, [&](const StoredGrid& grid) {
    return factorOf(wish, grid.descriptor) >= 1.0;
  });
}

ReadOptions readingCarried(const EsvrFile& file, const Options& options) {
  const DecodeOptions decode = decodingOf(file, options);
  return {.maxBytes = decode.maxBytes, .memory = decode.memory};
}

/// The grids that are not carried, in order.
std::vector<DecodedGrid> decodeAll(const EsvrFile& file, const std::vector<ListedGrid>& chosen,
                                   const Options& options, const cli::Log& log) {
  std::vector<DecodedGrid> grids;
  DecodeOptions decode = decodingOf(file, options);
  const std::uint64_t most = decode.maxBytes;
  const VoxelMemory inFiles = decode.memory.forAllSizes();
  for (const ListedGrid& named : chosen) {
    if (named.grid.isCarried) continue;
    // Grids that are small each may be too large together.
    if (decode.memory.isInFile(most - decode.maxBytes)) decode.memory = inFiles;
    try {
      grids.push_back(decoded(file, named, options, decode));
    } catch (const MemoryExceeded&) {
      if (decode.memory == inFiles) throw;
      decode.memory = inFiles;
      grids.push_back(decoded(file, named, options, decode));
    }
    if (activeVoxelsOf(grids.back()) == 0)
      log.warning("grid \"" + named.name + "\" comes back without an active voxel");
    // All grids are in memory, and twice while they are written.
    decode.maxBytes -= std::min(decode.maxBytes, 2 * bytesOf(grids.back()));
  }
  return grids;
}

/// All chosen grids in order. \param decoded  those that are not carried
std::vector<GridToWrite> inOrder(const EsvrFile& file, const std::vector<ListedGrid>& chosen,
                                 const std::vector<DecodedGrid>& decoded) {
  std::vector<GridToWrite> all;
  auto next = decoded.begin();
  for (const auto& [grid, name, place] : chosen)
    if (grid.isCarried)
      all.emplace_back(&file.carried[grid.index]);
    else
      all.push_back(std::visit([](const auto& g) { return GridToWrite(&g); }, *next++));
  return all;
}

/// The items that a NanoVDB file has no place for. It has one for the name and the class of a grid, and the name of the
/// program that wrote a file before is no property of it.
std::size_t lostItems(std::span<const MetaItem> items) {
  constexpr std::array<std::string_view, 3> kNotLost{"name", "class", kWriterKey};
  return std::size_t(std::ranges::count_if(items, [&](const MetaItem& item) {
    return std::ranges::find(kNotLost, item.name) == kNotLost.end();
  }));
}

/// Warns that a NanoVDB file cannot hold metadata.
void tellLostMetadata(const EsvrFile& file, const std::vector<DecodedGrid>& grids,
                      const Options& options, const cli::Log& log) {
  if (!writesNano(options)) return;
  std::size_t items = lostItems(file.metadata);
  for (const auto& grid : grids) items += lostItems(descriptorOf(grid).metadata);
  if (items == 0) return;
  log.warning("a NanoVDB file holds no metadata, which is left out",
              std::to_string(items) + (items == 1 ? " item" : " items"));
}

/// Warns of carried grids with which older versions of OpenVDB open no grid of the file, and of those whose doubles a
/// NanoVDB file does not get.
void tellCarried(const EsvrFile& file, const std::vector<ListedGrid>& chosen,
                 const Options& options, const cli::Log& log) {
  const bool isNano = writesNano(options);
  for (const auto& [grid, name, place] : chosen) {
    if (!grid.isCarried) continue;
    const std::string& type = file.carried[grid.index].treeType;
    if (!isNano && type.starts_with("Tree_half_"))
      log.warning("grid \"" + name +
                  "\" is a HalfGrid; only OpenVDB 13 and newer open a file with one");
    if (isNano && (type.starts_with("Tree_double_") || type.starts_with("Tree_vec3d_")))
      log.warning("grid \"" + name +
                  "\": its doubles are rounded to floats; a .vdb file keeps them");
  }
}

void tellNotCompared(const std::vector<ListedGrid>& chosen, const cli::Log& log) {
  for (const auto& [grid, name, place] : chosen)
    if (grid.isCarried)
      log.warning("grid \"" + name +
                  "\" was carried unchanged, and is not compared with the reference");
}

/// Warns of grids whose ellipsoids another program may evaluate to other values.
void tellImprecise(const EsvrFile& file, const std::vector<ListedGrid>& chosen,
                   const cli::Log& log) {
  for (const auto& [grid, name, place] : chosen) {
    if (grid.isCarried) continue;
    for (const StoredGrid& part : storedParts(file, grid))
      if (const std::string why = whyImprecise(part); !why.empty())
        log.warning("grid \"" + name + "\": " + why);
  }
}

/// Warns of grids that come back whole, although a part of their ellipsoids was asked for.
void tellUncut(const Content& content, const std::vector<ListedGrid>& chosen,
               const Options& options, const cli::Log& log) {
  const auto isPart = [&](const StoredGrid& grid) {
    const auto at = std::size_t(&grid - content.file.grids.data());
    return !content.ellipsoidsInFile.empty() &&
           grid.field.ellipsoidCount() < content.ellipsoidsInFile[at];
  };
  for (const auto& [grid, name, place] : chosen) {
    if (grid.isCarried) continue;
    const StoredGrid& stored = storedParts(content.file, grid).front();
    const std::string start = "grid \"" + name + "\" comes back whole: ";
    if (stored.voxels && isCut(options))
      log.warning(start + "it has voxels, and --lod and --max-ellipsoids select ellipsoids");
    else if (options.part.layers && layerCount(stored) == 1 && !isPart(stored))
      log.warning(start + "it has a single layer");
  }
}

/// The range of the active values of a grid of the reference.
std::optional<std::array<float, 2>> rangeIn(const Options& options, const VdbSummary& file,
                                            std::size_t place) {
  const GridSummary& grid = file.grids[place];
  if (grid.activeVoxels == 0 || !(grid.isScalar || grid.isVector)) return std::nullopt;
  ReadOptions read = readingOf(options);
  read.directory = file.directory;
  const VolumeGrid voxels = grid.isVector ? readComponent(*options.reference, place, 0, read)
                                          : readGrid(*options.reference, place, read);
  const ValueRange range = activeRange(voxels.volume);
  return std::array{range.min, range.max};
}

/// Finds each grid that is not carried in the reference, before anything is written. The file may lack
/// grids of the reference that share a name with others.
std::vector<ComparedGrid> counterparts(const EsvrFile& file, const std::vector<ListedGrid>& chosen,
                                       const Options& options) {
  const VdbSummary reference = inspectVdb(*options.reference);
  const auto ofGrids = cli::traitsOf(file);
  auto references = cli::traitsOf(reference);
  cli::addRanges(
      ofGrids, [&](std::size_t g) { return rangeIn(options, reference, g); }, references);
  const auto pairs = pairGrids(ofGrids, references);
  std::vector<std::string> names;
  for (const GridTraits& traits : references) names.push_back(traits.name);
  const GridNames ofReference(std::move(names)), ofFile(namesInOrder(file));
  std::vector<ComparedGrid> grids;
  for (std::size_t written = 0; written < chosen.size(); ++written) {
    const auto& [grid, name, place] = chosen[written];
    if (grid.isCarried) continue;
    ComparedGrid compared{.name = name, .written = written, .isVector = grid.isVector};
    compared.reference =
        pairs[place] ? *pairs[place] : ofReference.findWhole(name, *options.reference);
    for (std::size_t c = 0; c < kComponents; ++c)
      compared.components[c] = ofFile.ofComponent(place, c);
    grids.push_back(std::move(compared));
  }
  return grids;
}

}  // namespace

ReadLimits limitsOf(const Options& options) {
  return {options.memory.maxBytes, options.memory.voxels, readsAll(options)};
}

void convert(const Options& options) {
  const cli::Interrupts interrupts;
  checkFiles(options);
  convertFile(options, interrupts.token(), cli::Log(kProgram, options.verbosity), std::cout);
}

void convertFile(const Options& options, const CancelToken& cancel, const cli::Log& log,
                 std::ostream& out) {
  // It may be read twice, for the names of the grids and for the grids.
  const cli::WatchedInputs watched({options.input});
  const PartOfFile part = read(options, log);
  watched.requireUnchanged();
  convertContent(options, {part.file, part.ellipsoidsInFile}, cancel, log, out);
}

void convertContent(const Options& given, const Content& content, const CancelToken& cancel,
                    const cli::Log& log, std::ostream& out) {
  if (writesSplats(given)) return exportSplats(given, content.file, log);
  Options options = given;
  EsvrFile coarser;  // with voxels in place of carried grids
  const auto named = [&](const auto& action) { return namingFile(given.input.string(), action); };
  const Content all = named([&]() -> Content {
    if (!coarsensCarried(given, content.file)) return content;
    coarser = withCarriedAsVoxels(content.file, readingCarried(content.file, given));
    return {coarser};
  });
  options.resolution = named([&] {
    const auto stored = storedGrids(all.file, chooseGrids(given.input, all.file, given.grids));
    return resolved(given.resolution, stored, decodingOf(all.file, given), log);
  });
  // Where the memory allows all voxels, carried grids are written as they are.
  const Content& used = changesResolution(options) ? all : content;
  const EsvrFile& file = used.file;
  const auto chosen = named(
      [&] { return writable(file, chooseGrids(given.input, file, given.grids), options, log); });
  cli::WatchedInputs watched;
  if (options.reference) watched.add(*options.reference);
  std::vector<ComparedGrid> compared;
  if (options.reference) compared = counterparts(file, chosen, options);
  const auto grids =
      namingFile(given.input.string(), [&] { return decodeAll(file, chosen, options, log); });
  if (cancel.cancelled()) throw Cancelled();
  tellLostMetadata(file, grids, options, log);
  tellCarried(file, chosen, options, log);
  tellUncut(used, chosen, options, log);
  tellImprecise(file, chosen, log);
  namingFile(given.input.string(), [&] {
    writeGrids(options.output, file.metadata, inOrder(file, chosen, grids), options.write);
  });
  if (options.reference) {
    tellNotCompared(chosen, log);
    if (!compared.empty()) printErrors(options, compared, out);
  }
  watched.requireUnchanged();  // the errors are those of one file
}

// ---- Resolutions

namespace {

constexpr std::array kFactors{1, 2, 4, 8};

/// Bytes of all grids in memory, which are there twice more while they are written, and of the work.
double bytesOf(std::span<const StoredGrid* const> grids, int factor, const DecodeOptions& decode) {
  constexpr double kCopies = 3.0;
  double bytes = 0.0, work = 0.0;
  for (const StoredGrid* grid : grids) {
    const ResolutionBytes needed = bytesAtResolution(*grid, factor, decode);
    bytes += kCopies * double(needed.result);
    work = std::max(work, double(needed.work));
  }
  return bytes + work;
}

}  // namespace

bool changesResolution(const Options& options) {
  const Resolution& wish = options.resolution;
  return wish.isAuto || wish.voxelSize || wish.factor != 1.0;
}

Resolution resolved(const Resolution& wish, std::span<const StoredGrid* const> grids,
                    const DecodeOptions& decode, const cli::Log& log) {
  if (!wish.isAuto) return wish;
  for (const int factor : kFactors) {
    const double bytes = bytesOf(grids, factor, decode);
    if (factor == kFactors.back())
      requireWithinMemory(bytes, decode.maxBytes,
                          "decoding the grids with voxels 8 times as large");
    if (bytes > double(decode.maxBytes)) continue;
    if (factor > 1)
      log.info("--coarsen auto: voxels become " + std::to_string(factor) +
               " times as large along each axis, so that the grids fit into the memory");
    return {.factor = double(factor)};
  }
  return wish;
}

double factorOf(const Resolution& wish, const GridDescriptor& grid) {
  try {
    const double factor = wish.voxelSize ? factorFor(grid.transform, *wish.voxelSize) : wish.factor;
    (void)transformAt(grid.transform, factor);
    return factor;
  } catch (const UsageError& refusal) {
    // The refusal knows the transform, and not the name of the grid.
    throw UsageError("grid '" + shownName(grid.name) + "': " + refusal.what());
  }
}

Resolution resolutionOf(const std::optional<std::string>& coarsen,
                        const std::optional<double>& voxelSize) {
  if (coarsen && voxelSize) throw UsageError("--coarsen and --voxel-size exclude each other");
  if (!coarsen) return {.voxelSize = voxelSize};
  if (*coarsen == "auto") return {.isAuto = true};
  for (const int factor : kFactors)
    if (factor > 1 && *coarsen == std::to_string(factor)) return {.factor = double(factor)};
  throw UsageError("--coarsen must be 2, 4, 8 or auto, not '" + *coarsen + "'");
}

// ---- Splats

namespace {

/// The index in EsvrFile::grids of the grid that is wanted: by its name, or the first that is called "density", or
/// the first.
std::size_t chooseGrid(const Options& options, const EsvrFile& file) {
  if (options.grids.size() > 1)
    throw UsageError("a file of splats has one grid; name it once with --grid");
  if (!options.grids.empty()) return findStored(file, options.grids.front(), options.input);
  if (file.grids.empty()) throw BadInput(options.input.string() + ": no grid of it has ellipsoids");
  const auto isDensity = [](const StoredGrid& grid) { return grid.descriptor.name == "density"; };
  const auto found = std::ranges::find_if(file.grids, isDensity);
  return found == file.grids.end() ? 0 : std::size_t(found - file.grids.begin());
}

/// The part of a grid that options ask for.
StoredGrid partOf(StoredGrid grid, const Options& options) {
  if (options.part.layers) grid = firstLayers(std::move(grid), *options.part.layers);
  if (options.maxEllipsoids) grid = heaviest(std::move(grid), *options.maxEllipsoids);
  if (options.part.box) grid.activeBox = common(grid.activeBox, *options.part.box);
  if (options.part.box && (grid.activeBox.empty() || grid.field.ellipsoidCount() == 0))
    throw CannotConvert("grid \"" + shownName(grid.descriptor.name) +
                        "\" has nothing in the box of --bbox, " + cli::textOf(*options.part.box));
  return grid;
}

/// The colors over the range of a grid's values and its background, as esvr-render has them.
ColorMap colorsFor(const ColorMap& colors, const StoredGrid& grid) {
  const auto background = float(grid.descriptor.background);
  const ValueRange range{std::min(grid.valueMin, background), std::max(grid.valueMax, background)};
  return rescaled({colors, {{0.0, 1.0}}}, range).colors;
}

void tellWhatIsMissing(const MadeSplats& made, const cli::Log& log) {
  constexpr double kMuch = 1e-3;
  log.detail(cli::counted(made.scene.splats.size(), "splat") + " of " +
             cli::counted(made.ellipsoids, "ellipsoid") + ", with an extinction of " +
             cli::shortNumber(made.scene.densityScale) +
             " for a value of 1 and a unit of the world");
  if (made.negative > 0)
    log.detail(cli::counted(made.negative, "ellipsoid") +
               " of negative values, which splats cannot have, left out");
  if (made.faintShare > kMuch)
    log.warning(
        "a part of the optical depth is left out, because it is too faint for the 8 bits of "
        "formats; a larger --density-scale or fewer ellipsoids keep more of it",
        cli::shortNumber(100.0 * made.faintShare) + " %");
  if (made.clamped > 0)
    log.warning("splats have the smallest or the largest size that formats keep",
                std::to_string(made.clamped));
}

}  // namespace

bool writesSplats(const Options& options) {
  const auto extension = options.output.extension();
  return extension == ".ply" || extension == ".usda";
}

void exportSplats(const Options& options, const EsvrFile& file, const cli::Log& log) {
  const std::size_t chosen = chooseGrid(options, file);
  const std::string input = options.input.string();
  const StoredGrid grid = namingFile(input, [&] { return partOf(file.grids[chosen], options); });
  SplatOptions wanted = options.splats.made;
  wanted.colors = colorsFor(wanted.colors, grid);
  wanted.maxBytes = options.memory.maxBytes;
  if (options.output.extension() == ".usda") wanted.form = SplatForm::kUsd;
  const MadeSplats made = namingFile(input, [&] { return makeSplats(grid, wanted); });
  tellWhatIsMissing(made, log);
  namingFile(input, [&] {
    writeSplats(options.output, made.scene, wanted.form, options.write.overwrite);
  });
}

void importSplats(const Options& options) {
  const cli::Interrupts interrupts;
  const cli::Log log(kProgram, options.verbosity);
  cli::requireSeparate(options.inputs.paths, {options.output});
  cli::checkOutput(options.output, {".vdb", ".nvdb"}, options.write.overwrite);
  const cli::WatchedInputs watched({options.input});
  const SplatGrids grids =
      cli::readSplatGrids(options.input, options.splats.read, options.memory, log);
  std::vector<GridToWrite> written{&grids.density};
  const bool isNano = options.output.extension() == ".nvdb";
  if (grids.color && !isNano) written.emplace_back(&*grids.color);
  if (grids.color && isNano)
    log.warning("the colors are left out: vectors are not written to NanoVDB files");
  watched.requireUnchanged();
  namingFile(options.input.string(),
             [&] { writeGrids(options.output, {}, written, options.write); });
}

}  // namespace esvr::esvr2vdb
