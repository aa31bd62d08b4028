// Lists what files hold (--list), and checks them (--check).
#include "esvr2vdb/jobs.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstring>
#include <filesystem>
#include <iostream>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "esvr/container.h"
#include "esvr/error.h"
#include "esvr/grid.h"
#include "esvr/sequence_file.h"
#include "esvr/splats.h"
#include "esvr/vdb_io.h"
#include "programs/option_values.h"
#include "programs/run_main.h"
#include "programs/sequence.h"
#include "programs/splat_input.h"

namespace esvr::esvr2vdb {
namespace {

namespace fs = std::filesystem;

// What metadata says: who made a file, how fast its frames play, and what its numbers measure.

/// Names of frame rates without capitals and signs: "fps", "FrameRate", "frames_per_second".
constexpr std::array kFrameRates{"fps", "framerate", "framespersecond", "timecodespersecond"};
/// A longer text is cut, because a file may have any.
constexpr std::size_t kMostLetters = 80;

bool isLetter(char c) { return std::isalpha(static_cast<unsigned char>(c)) != 0; }
bool isCapital(char c) { return std::isupper(static_cast<unsigned char>(c)) != 0; }
char lowered(char c) { return char(std::tolower(static_cast<unsigned char>(c))); }

/// The words of a name without capitals: "length_unit" and "lengthUnit" are "length" and "unit".
std::vector<std::string> wordsOf(std::string_view name) {
  std::vector<std::string> words{""};
  for (std::size_t i = 0; i < name.size(); ++i) {
    const bool begins = i > 0 && isCapital(name[i]) && !isCapital(name[i - 1]);
    if ((begins || !isLetter(name[i])) && !words.back().empty()) words.emplace_back();
    if (isLetter(name[i])) words.back() += lowered(name[i]);
  }
  return words;
}

bool isLookedFor(std::string_view name) {
  const std::vector<std::string> words = wordsOf(name);
  std::string joined;
  for (const std::string& word : words) joined += word;
  return joined == "creator" || std::ranges::count(kFrameRates, joined) > 0 ||
         std::ranges::count(words, "unit") + std::ranges::count(words, "units") > 0;
}

template <class T>
std::optional<std::string> numberIn(const MetaItem& item) {
  T value{};
  if (item.value.size() != sizeof value) return std::nullopt;
  std::memcpy(&value, item.value.data(), sizeof value);
  if constexpr (std::is_integral_v<T>) return std::to_string(value);
  return cli::shortNumber(double(value));
}

/// The value of an item that is a text or a number; nothing for others.
std::optional<std::string> valueOf(const MetaItem& item) {
  if (item.type == "float") return numberIn<float>(item);
  if (item.type == "double") return numberIn<double>(item);
  if (item.type == "int32") return numberIn<std::int32_t>(item);
  if (item.type == "int64") return numberIn<std::int64_t>(item);
  if (item.type != "string" || item.value.empty()) return std::nullopt;
  const std::string_view text(reinterpret_cast<const char*>(item.value.data()), item.value.size());
  const bool isLong = text.size() > kMostLetters;
  return std::string(text.substr(0, kMostLetters)) + (isLong ? "..." : "");
}

/// The items that people look for, in the order of the file, as "creator Houdini 20.5, fps 24": the
/// creator, the frame rate, and every item with the word "unit" or "units" in its name.
std::string notesOf(std::span<const MetaItem> metadata) {
  std::string notes;
  for (const MetaItem& item : metadata)
    if (const auto value = valueOf(item); value && isLookedFor(item.name))
      notes += (notes.empty() ? "" : ", ") + item.name + ' ' + *value;
  return notes;
}

/// Notes of the grids of a file. Grids of the same notes are named in one line.
class GridNotes {
 public:
  void add(const std::string& grid, std::span<const MetaItem> metadata) {
    const std::string text = notesOf(metadata);
    if (text.empty()) return;
    std::string& names = grids_[text];
    if (names.empty()) texts_.push_back(text);
    names += (names.empty() ? "" : ", ") + grid;
  }

  /// Prints a line for each text: "density, heat: length_unit mm".
  void print() const {
    for (const std::string& text : texts_)
      std::cout << cli::printable(grids_.at(text) + ": " + text) << '\n';
  }

 private:
  std::vector<std::string> texts_;            ///< the notes in the order in which they were added
  std::map<std::string, std::string> grids_;  ///< names by text
};

/// Prints the notes of a file in a line, if there are any.
void printFileNotes(std::span<const MetaItem> metadata) {
  if (const std::string notes = notesOf(metadata); !notes.empty())
    std::cout << cli::printable(notes) << '\n';
}

// A VDB file.

void printGrids(const VdbSummary& file) {
  cli::Table table({"grid", "class", "values", "active voxels", "bytes"});
  for (const auto& grid : file.grids)
    table.add({grid.uniqueName, className(grid.gridClass), cli::valuesOf(grid),
               cli::activeVoxelsOf(grid), std::to_string(grid.storedBytes)});
  table.print(std::cout);
}

void printDetails(const VdbSummary& file) {
  cli::printMetadata("file metadata", file.metadata, std::cout);
  for (const auto& grid : file.grids) {
    std::cout << cli::printable(grid.uniqueName) << ": active box " << cli::textOf(grid.activeBox);
    if (!grid.skipReason.empty()) std::cout << "; " << cli::printable(grid.skipReason);
    std::cout << '\n';
  }
}

/// Prints the grids of a .vdb or .nvdb file.
void listVdb(const Options& options) {
  const VdbSummary file = inspectVdb(options.input);
  std::cout << cli::printable(options.input.string()) << ": " << file.format << ", "
            << file.fileBytes << " bytes" << (file.grids.empty() ? ", no grid" : "") << '\n';
  printFileNotes(file.metadata);
  std::cout << '\n';
  printGrids(file);
  GridNotes notes;
  for (const GridSummary& grid : file.grids) notes.add(grid.uniqueName, grid.metadata);
  notes.print();
  if (options.verbosity != cli::Verbosity::kVerbose) return;
  std::cout << '\n';
  printDetails(file);
}

// A file of splats.

/// Prints what a file of splats holds. All of it is read.
void listSplats(const Options& options) {
  const SplatFile file = readSplats(options.input, {.maxBytes = options.memory.maxBytes});
  const Splats& splats = file.scene.splats;
  std::cout << cli::printable(options.input.string()) << ": splats, "
            << fs::file_size(options.input) << " bytes\n\n";
  cli::Table table({"splats", "left out", "colors", "place in the world", "density scale"});
  const char* const colors = file.hasHigherDegrees ? "by direction" : "of degree 0";
  table.add({std::to_string(file.inFile), std::to_string(file.dropped()),
             splats.hasColors() ? colors : "-", file.hasPlacement ? "known" : "-",
             cli::shortNumber(file.scene.densityScale)});
  table.print(std::cout);
}

// Metadata.

/// The metadata of a grid. That of vectors is with their first component, and that of a carried grid is in
/// its bytes, which may not have been read.
std::vector<MetaItem> metadataOf(const EsvrFile& file, const ListedGrid& listed) {
  if (!listed.grid.isCarried) return storedParts(file, listed.grid).front().descriptor.metadata;
  const CarriedGrid& carried = file.carried[listed.grid.index];
  return carried.bytes.empty() ? std::vector<MetaItem>() : inspectCarried(carried).metadata;
}

// A sequence.

std::vector<std::string> rowOf(const SequenceFrame& frame) {
  return {std::to_string(frame.number), std::to_string(frame.group), std::to_string(frame.bytes),
          frame.dependsOnPrevious ? "frame before" : "-"};
}

/// What the file of a frame says of itself.
struct FrameFile {
  std::string grids;  ///< their names; "-" if there are none
  std::string notes;  ///< what the file's metadata say
};

FrameFile inspectFrame(const fs::path& path, const Options& options) {
  std::vector<std::string> names;
  FrameFile frame;
  if (path.extension() == ".esvr") {
    // The grids' records suffice, so that nothing is decoded.
    ReadPart wanted{.limits = limitsOf(options)};
    wanted.grids.emplace();
    const EsvrFile file = readEsvrPart(path, wanted).file;
    for (const ListedGrid& grid : listedGrids(file)) names.push_back(grid.name);
    frame.notes = notesOf(file.metadata);
  } else {
    const VdbSummary file = inspectVdb(path);
    for (const GridSummary& grid : file.grids) names.push_back(grid.uniqueName);
    frame.notes = notesOf(file.metadata);
  }
  for (const std::string& name : names) frame.grids += (frame.grids.empty() ? "" : ", ") + name;
  if (frame.grids.empty()) frame.grids = "-";
  return frame;
}

/// The files of the frames of a pattern, which are inspected one after the other.
class FrameFiles {
 public:
  FrameFiles(const Options& options, const cli::FramePattern& pattern)
      : pattern_(pattern),
        listing_(cli::framesOnDisk(pattern)),
        log_(kProgram, options.verbosity) {}

  /// Calls a function with the number and the file of each frame. If it fails, the others follow.
  template <class Inspect>
  void forEach(const Inspect& inspect) {
    for (const cli::FrameNumber frame : listing_.frames) try {
        inspect(frame, pattern_.toRead(frame));
      } catch (const Error& error) {
        log_.error("frame " + std::to_string(frame) + ": " + error.what());
        if (!first_) first_ = error;
        failed_.push_back(frame);
      }
  }

  [[nodiscard]] std::size_t size() const { return listing_.frames.size(); }

  /// Tells what looks like frames and is none.
  void tellHint() const {
    if (const std::string hint = listing_.hint(); !hint.empty())
      log_.warning(pattern_.text() + ": " + hint);
  }

  /// \throws Error  the kind of the first frame that failed
  void throwFailures() const {
    if (first_) throw Error(first_->kind(), cli::sentenceOn(failed_, size(), "failed"));
  }

 private:
  const cli::FramePattern& pattern_;
  const cli::FrameListing listing_;
  const cli::Log log_;
  std::vector<cli::FrameNumber> failed_;
  std::optional<Error> first_;
};

/// Prints a row for the file of each frame of a pattern.
void listFrames(const Options& options, const cli::FramePattern& pattern) {
  FrameFiles files(options, pattern);
  cli::Table table({"frame", "bytes", "grids"});
  std::string notes;  // those of the first frame that has any
  files.forEach([&](cli::FrameNumber frame, const fs::path& path) {
    FrameFile file = inspectFrame(path, options);
    table.add({std::to_string(frame), std::to_string(fs::file_size(path)), std::move(file.grids)});
    if (notes.empty()) notes = std::move(file.notes);
  });
  std::cout << cli::printable(pattern.text()) << ": " << cli::counted(files.size(), "frame")
            << ", a file each\n"
            << cli::printable(notes) << (notes.empty() ? "\n" : "\n\n");
  table.print(std::cout);
  files.tellHint();
  files.throwFailures();
}

/// Prints the frames of a file that holds a sequence.
void listSequence(const Options& options) {
  const SequenceReader reader(options.input, limitsOf(options));
  const EsvrFile first = reader.propertiesOfFirst();
  const EsvrSummary summary = inspectEsvr(options.input);
  std::cout << cli::printable(options.input.string()) << ": .esvr format " << summary.versionMajor
            << '.' << summary.versionMinor << ", " << summary.fileBytes << " bytes, "
            << cli::counted(reader.frames().size(), "frame") << " in "
            << cli::counted(reader.groupCount(), "group") << '\n';
  printFileNotes(first.metadata);
  std::cout << '\n';
  cli::Table table({"frame", "group", "bytes", "refers to"});
  for (const SequenceFrame& frame : reader.frames()) table.add(rowOf(frame));
  table.print(std::cout);
  GridNotes notes;
  for (const ListedGrid& grid : listedGrids(first)) notes.add(grid.name, metadataOf(first, grid));
  notes.print();
}

// An .esvr file.

std::string textOf(const Kernel& kernel) {
  return cli::nameOf(kernel.form) + " " + cli::shortNumber(kernel.kappa);
}

std::string bytesPerEllipsoid(std::uint64_t bytes, std::uint64_t ellipsoids) {
  return ellipsoids == 0 ? "-" : cli::shortNumber(double(bytes) / double(ellipsoids));
}

struct Listing {
  const Options& options;
  EsvrFile file;
  std::vector<std::uint64_t> ellipsoids;  ///< number of ellipsoids of each of the file's grids
  EsvrSummary summary;
  std::vector<ListedGrid> grids;    ///< in file order
  std::vector<ListedGrid> parts{};  ///< the same, with the components in place of vectors
  std::map<std::size_t, std::string> names{};  ///< of the parts, by their numbers in the summary

  /// The number of a grid in the summary.
  [[nodiscard]] std::size_t numberOf(const GridOfFile& grid) const {
    return grid.index + (grid.isCarried ? file.grids.size() : 0);
  }
};

/// The grids and the components of vectors.
std::vector<ListedGrid> withComponents(const EsvrFile& file, const std::vector<ListedGrid>& grids) {
  const GridNames names(namesInOrder(file));
  std::vector<ListedGrid> parts;
  for (const ListedGrid& named : grids) {
    if (!named.grid.isVector) {
      parts.push_back(named);
      continue;
    }
    for (std::size_t c = 0; c < kComponents; ++c)
      parts.push_back({{false, file.vectors[named.grid.index].first + c},
                       names.ofComponent(named.place, c),
                       named.place});
  }
  return parts;
}

/// OpenVDB's name of the type of vectors whose components have this type.
std::string vectorsOf(ValueType component) {
  if (component == ValueType::kDouble) return "vec3d";
  return component == ValueType::kHalf ? "vec3s as half" : "vec3s";
}

/// The row of a grid of vectors. The rows of its components follow.
std::vector<std::string> rowOfVector(const Listing& listing, const ListedGrid& named) {
  const StoredVector& vector = listing.file.vectors[named.grid.index];
  std::uint64_t voxels = 0, bytes = 0, ellipsoids = 0;
  for (std::size_t g = vector.first; g < vector.first + kComponents; ++g) {
    voxels = std::max(voxels, listing.file.grids[g].activeVoxels);
    ellipsoids += listing.ellipsoids[g];
    bytes += cli::ownBytes(listing.summary, g);
  }
  const GridDescriptor& descriptor = listing.file.grids[vector.first].descriptor;
  return {named.name,
          className(descriptor.gridClass),
          vectorsOf(descriptor.valueType),
          std::to_string(voxels),
          std::to_string(ellipsoids),
          "-",
          "-",
          "-",
          std::to_string(bytes),
          "-"};
}

std::vector<std::string> rowOfStored(const Listing& listing, const ListedGrid& named) {
  const StoredGrid& grid = listing.file.grids[named.grid.index];
  const std::uint64_t bytes = cli::storedBytes(listing.summary, named.grid.index);
  const std::uint64_t ellipsoids = listing.ellipsoids[named.grid.index];
  return {named.name,
          className(grid.descriptor.gridClass),
          cli::nameOf(grid.descriptor.valueType),
          std::to_string(grid.activeVoxels),
          std::to_string(ellipsoids),
          textOf(grid.field.kernel),
          grid.tone.isOn() ? cli::shortNumber(grid.tone.scale) : "-",
          cli::nameOf(grid.topology),
          std::to_string(cli::ownBytes(listing.summary, named.grid.index)),
          bytesPerEllipsoid(bytes, ellipsoids)};
}

/// \throws BadInput  the bytes are not those of a grid
GridSummary summaryOf(const Options& options, const CarriedGrid& grid) try {
  return inspectCarried(grid);
} catch (const BadInput& error) {
  throw BadInput(options.input.string() + ": " + error.what());
}

std::vector<std::string> rowOfCarried(const Listing& listing, const ListedGrid& named) {
  const GridSummary grid = summaryOf(listing.options, listing.file.carried[named.grid.index]);
  const std::size_t number = listing.numberOf(named.grid);
  return {named.name,
          className(grid.gridClass),
          cli::valuesOf(grid),
          cli::activeVoxelsOf(grid),
          "carried",
          "-",
          "-",
          "-",
          std::to_string(cli::ownBytes(listing.summary, number)),
          "-"};
}

/// The number of voxels of a grid that are NaN or infinite, over the components of vectors.
std::uint64_t nonFiniteIn(const Listing& listing, const GridOfFile& grid) {
  std::uint64_t count = 0;
  if (!grid.isCarried)
    for (const StoredGrid& part : storedParts(listing.file, grid)) count += part.nonFinite.total();
  return count;
}

/// The last column is there only if a grid has voxels that are not finite.
void printGrids(const Listing& listing) {
  std::vector<std::string> titles{"grid",       "class",         "values", "active voxels",
                                  "ellipsoids", "kernel, kappa", "tone",   "active by",
                                  "bytes",      "bytes each"};
  const bool anyNonFinite = std::ranges::any_of(
      listing.grids, [&](const ListedGrid& grid) { return nonFiniteIn(listing, grid.grid) > 0; });
  if (anyNonFinite) titles.emplace_back("not finite");
  cli::Table table(std::move(titles));
  const auto add = [&](std::vector<std::string> row, const GridOfFile& grid) {
    if (anyNonFinite) row.push_back(std::to_string(nonFiniteIn(listing, grid)));
    table.add(std::move(row));
  };
  std::size_t place = listing.grids.size();
  for (const ListedGrid& part : listing.parts) {
    const ListedGrid& grid = listing.grids[part.place];
    if (grid.grid.isVector && part.place != place) add(rowOfVector(listing, grid), grid.grid);
    place = part.place;
    add(part.grid.isCarried ? rowOfCarried(listing, part) : rowOfStored(listing, part), part.grid);
  }
  table.print(std::cout);
  GridNotes notes;
  for (const ListedGrid& grid : listing.grids) notes.add(grid.name, metadataOf(listing.file, grid));
  notes.print();
}

/// The name of a section's grid; "-" if it belongs to the file.
std::string gridOf(const Listing& listing, const SectionSummary& section) {
  const auto name = listing.names.find(section.grid);
  return name == listing.names.end() ? "-" : name->second;
}

void printSections(const Listing& listing) {
  cli::Table table({"section", "of grid", "codec", "bytes", "raw bytes", "shared with"});
  const auto& sections = listing.summary.sections;
  for (const auto& s : sections)
    table.add({s.kind, gridOf(listing, s), s.codec, std::to_string(s.storedBytes),
               std::to_string(s.rawBytes),
               s.sharedWith ? gridOf(listing, sections[*s.sharedWith]) : "-"});
  table.print(std::cout);
}

void addStream(cli::Table& table, const std::string& grid, const char* stream, std::uint64_t bytes,
               std::size_t ellipsoids) {
  table.add({grid, stream, std::to_string(bytes), bytesPerEllipsoid(bytes, ellipsoids)});
}

/// Prints the bytes of the quantised ellipsoids, by stream.
void printStreams(const Listing& listing) {
  cli::Table table({"grid", "stream", "bytes", "bytes each"});
  for (const auto& [place, name, number] : listing.parts) {
    if (place.isCarried) continue;
    const StoredGrid& grid = listing.file.grids[place.index];
    if (grid.quantised.empty()) continue;
    const StreamBytes bytes = streamBytes(grid);
    const std::size_t ellipsoids = grid.field.ellipsoidCount();
    addStream(table, name, "positions", bytes.positions, ellipsoids);
    addStream(table, name, "scales", bytes.scales, ellipsoids);
    addStream(table, name, "rotations", bytes.rotations, ellipsoids);
    addStream(table, name, "intensities", bytes.intensities, ellipsoids);
  }
  table.print(std::cout);
}

/// Prints the error and the bytes of the first layers.
void printLayers(const Listing& listing) {
  cli::Table table({"grid", "layers", "ellipsoids", "bytes", "PSNR box", "max error"});
  for (const auto& [place, name, number] : listing.parts) {
    if (place.isCarried) continue;
    const auto& errors = listing.file.grids[place.index].layerErrors;
    const auto sizes = layerSizes(listing.file.grids[place.index]);
    LayerSize sum;
    for (std::size_t k = 0; k < sizes.size(); ++k) {
      sum.ellipsoids += sizes[k].ellipsoids;
      sum.bytes += sizes[k].bytes;
      const bool known = k < errors.size();
      table.add({name, std::to_string(k + 1), std::to_string(sum.ellipsoids),
                 std::to_string(sum.bytes), known ? cli::decibels(errors[k].psnrBox) : "-",
                 known ? cli::shortNumber(errors[k].maxError) : "-"});
    }
  }
  table.print(std::cout);
}

/// The name of the grid whose voxels those of a grid refer to; empty if there is none.
std::string referenceOf(const Listing& listing, const StoredGrid& grid) {
  if (!grid.reference || !grid.reference->grid) return "";
  const auto name = listing.names.find(*grid.reference->grid);
  return name == listing.names.end() ? "" : name->second;
}

void printStoredDetails(const Listing& listing, const std::string& name, const StoredGrid& grid) {
  std::cout << cli::printable(name) << ": " << cli::printable(grid.descriptor.transform.mapType)
            << ", background " << cli::shortNumber(grid.descriptor.background) << ", values "
            << cli::shortNumber(grid.valueMin) << " to " << cli::shortNumber(grid.valueMax) << ", "
            << cli::activityOf(grid) << ", active box " << cli::textOf(grid.activeBox)
            << ", chunks " << grid.field.chunks.size();
  if (grid.nonFinite.total() > 0)
    std::cout << ", " << cli::textOf(grid.nonFinite) << " in "
              << cli::counted(grid.nonFiniteVoxels->bricks.size(), "brick");
  if (const std::string reference = referenceOf(listing, grid); !reference.empty())
    std::cout << ", voxels refer to " << cli::printable(reference);
  std::cout << '\n';
  cli::printMetadata(name + " metadata", grid.descriptor.metadata, std::cout);
}

void printCarriedDetails(const Options& options, const std::string& name, const CarriedGrid& grid) {
  std::cout << cli::printable(name) << ": carried unchanged, " << cli::printable(grid.treeType)
            << ", " << grid.bytes.size() << " bytes of VDB format " << grid.vdbVersion
            << ", active box " << cli::textOf(summaryOf(options, grid).activeBox) << '\n';
}

void printDetails(const Listing& listing) {
  cli::printMetadata("file metadata", listing.file.metadata, std::cout);
  for (const auto& [grid, name, number] : listing.parts)
    if (grid.isCarried)
      printCarriedDetails(listing.options, name, listing.file.carried[grid.index]);
    else
      printStoredDetails(listing, name, listing.file.grids[grid.index]);
}

/// Reads a file. A table of its grids needs their records only; details need all of it.
PartOfFile readForList(const Options& options) {
  ReadPart wanted{.carriedBytes = true, .limits = limitsOf(options)};
  if (options.verbosity != cli::Verbosity::kVerbose) wanted.grids.emplace();
  return readEsvrPart(options.input, wanted);
}

}  // namespace

void list(const Options& options) {
  if (const auto pattern = cli::FramePattern::ofInput(options.input.string()))
    return listFrames(options, *pattern);
  const auto extension = options.input.extension();
  if (extension == ".vdb" || extension == ".nvdb") return listVdb(options);
  if (cli::isSplatFile(options.input)) return listSplats(options);
  if (holdsSequence(options.input)) return listSequence(options);
  PartOfFile part = readForList(options);
  Listing listing{options,
                  std::move(part.file),
                  std::move(part.ellipsoidsInFile),
                  inspectEsvr(options.input),
                  {}};
  listing.grids = listedGrids(listing.file);
  listing.parts = withComponents(listing.file, listing.grids);
  for (const ListedGrid& listed : listing.parts)
    listing.names[listing.numberOf(listed.grid)] = listed.name;
  std::cout << cli::printable(options.input.string()) << ": .esvr format "
            << listing.summary.versionMajor << '.' << listing.summary.versionMinor << ", "
            << listing.summary.fileBytes << " bytes" << (listing.grids.empty() ? ", no grid" : "")
            << '\n';
  printFileNotes(listing.file.metadata);
  std::cout << '\n';
  printGrids(listing);
  std::cout << '\n';
  printSections(listing);
  if (options.verbosity != cli::Verbosity::kVerbose) return;
  std::cout << '\n';
  printStreams(listing);
  std::cout << '\n';
  printLayers(listing);
  std::cout << '\n';
  printDetails(listing);
}

// --check.

namespace {

/// \throws BadInput  with a line for each fault
void throwFaults(const Options& options, const std::vector<SequenceFault>& faults,
                 std::size_t frames) {
  std::vector<cli::FrameNumber> lost;
  std::string lines;
  for (const SequenceFault& fault : faults) {
    if (fault.frame) lost.push_back(*fault.frame);
    lines += "\n  " + fault.text;
  }
  throw BadInput(options.input.string() + ": " +
                 (lost.empty() ? "it is damaged, but no frame is lost"
                               : cli::sentenceOn(lost, frames, "are lost")) +
                 lines);
}

void checkFrames(const Options& options) {
  const ReadLimits limits{options.memory.maxBytes, options.memory.voxels};
  const std::size_t frames = SequenceReader(options.input, limits).frames().size();
  const auto faults = checkSequence(options.input, limits);
  if (!faults.empty()) throwFaults(options, faults, frames);
  if (options.verbosity != cli::Verbosity::kQuiet)
    std::cout << cli::printable(options.input.string()) << ": OK\n";
}

void checkFile(const Options& options) {
  if (holdsSequence(options.input)) return checkFrames(options);
  const std::string name = cli::printable(options.input.string());
  const auto notes = checkEsvr(options.input, {options.memory.maxBytes, options.memory.voxels});
  if (options.verbosity == cli::Verbosity::kQuiet) return;
  for (const auto& note : notes) std::cout << name << ": note: " << cli::printable(note) << '\n';
  std::cout << name << ": OK\n";
}

/// Checks the file of each frame.
void checkFilesOf(const Options& options, const cli::FramePattern& pattern) {
  FrameFiles files(options, pattern);
  files.tellHint();
  files.forEach([&](cli::FrameNumber, const fs::path& path) {
    Options own = options;
    own.input = path;
    checkFile(own);
  });
  files.throwFailures();
}

}  // namespace

void check(const Options& options) {
  if (const auto pattern = cli::FramePattern::ofInput(options.input.string()))
    return checkFilesOf(options, *pattern);
  checkFile(options);
}

}  // namespace esvr::esvr2vdb
