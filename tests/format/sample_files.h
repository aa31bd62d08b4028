#pragma once
/// Small deterministic files to encode, which are made without a fit, and their comparison bit by bit; the content of
/// the golden files; and small files of sequences.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "esvr/container.h"
#include "format/section_table.h"
#include "support/files.h"

namespace esvr::test {

/// The optional parts that the ellipsoids of a chunk have.
struct EllipsoidParts {
  bool rotations = true;
  bool kappas = false;
};

/// n ellipsoids spread over 64^3 voxels, with different parameters, already in the order of the
/// file.
[[nodiscard]] Ellipsoids sampleEllipsoids(std::size_t n, std::uint32_t seed,
                                          EllipsoidParts parts = {});

/// A fog volume with one chunk, metadata and a curve.
[[nodiscard]] StoredGrid fogGrid(std::size_t ellipsoids);

/// A level set with bricks, a double background, a frustum map (not affine) and no rotations.
[[nodiscard]] StoredGrid levelSetGrid(std::size_t ellipsoids);

/// Three chunks; the middle one is empty, and the last one has a kappa for each ellipsoid.
[[nodiscard]] StoredGrid chunkedGrid(std::size_t ellipsoidsPerChunk);

/// A fog volume with quantised ellipsoids in two chunks, the second one with signs.
[[nodiscard]] StoredGrid quantisedGrid(std::size_t ellipsoidsPerChunk);

/// The same in importance layers: four for each chunk if there are enough precisions.
[[nodiscard]] StoredGrid layeredGrid(std::size_t ellipsoidsPerChunk);

/// The ellipsoids of a grid with a residual that corrects three voxels of a brick.
[[nodiscard]] StoredGrid corrected(StoredGrid grid);

/// A grid with a background and nothing else.
[[nodiscard]] StoredGrid emptyGrid();

/// A carried grid with these bytes.
[[nodiscard]] CarriedGrid carriedGrid(std::uint32_t place, const std::string& bytes);

/// A file with all grids above, a grid that shares the data of the first one, two carried grids and
/// metadata.
[[nodiscard]] EsvrFile everything(std::size_t ellipsoids);

[[nodiscard]] EsvrFile fileOf(StoredGrid grid);

/// Compares all members, floating-point numbers bit by bit. \return the name of the first that
/// differs, or ""
[[nodiscard]] std::string difference(const EsvrFile& a, const EsvrFile& b);

/// The difference between a file and what is read of its bytes.
[[nodiscard]] std::string lossOf(const EsvrFile& file);

/// The message with which a reader refuses the file "lie.esvr", and a writer a content; or "none".
[[nodiscard]] std::string refusalToRead(const std::vector<std::byte>& bytes);
[[nodiscard]] std::string refusalToWrite(const EsvrFile& file);
[[nodiscard]] bool isRefused(const std::vector<std::byte>& bytes);

// ---- The content of the files in tests/format/golden, and how this version of the format writes them

struct GoldenFile {
  std::string name;
  EsvrFile content;
  bool unknownSection = false;  ///< an optional section of an unknown kind follows
};

[[nodiscard]] std::vector<GoldenFile> goldenFiles();

/// The file as this library writes it.
[[nodiscard]] std::vector<std::byte> bytesOf(const GoldenFile& golden);

// ---- Sequences

/// A frame with a grid of voxels and ellipsoids that depends on the number. Frames whose number is
/// a multiple of 5 have no grids.
[[nodiscard]] EsvrFile sampleFrame(std::int64_t number);

/// Writes groups of frames, which refer to no other frame.
void writeSequence(const std::filesystem::path& path,
                   const std::vector<std::vector<std::int64_t>>& groups);

/// The same, but all frames except the first ones of groups say that they refer to the frame before
/// them. Their bytes do not need it.
void writeChains(const std::filesystem::path& path,
                 const std::vector<std::vector<std::int64_t>>& groups);

/// Writes the golden sequence: the frames -2 and 1 in one group, and frame 3 in another one. They
/// are the golden files one_ellipsoid, no_grid and voxels.
void writeGoldenSequence(const std::filesystem::path& path);

// ---- Files that lie

struct CraftedSection {
  format::SectionEntry entry;
  std::vector<std::byte> stored;
};

class CraftedFile {
 public:
  explicit CraftedFile(const std::vector<std::byte>& bytes);

  /// The section of a kind, in the first grid or chunk that has one.
  [[nodiscard]] CraftedSection& section(format::SectionKind kind);
  void erase(format::SectionKind kind);

  /// Adds a section with raw content.
  CraftedSection& add(const format::SectionId& id, std::uint16_t flags,
                      std::vector<std::byte> stored);

  /// The uncompressed content of a section. The setter replaces it.
  [[nodiscard]] std::vector<std::byte> content(format::SectionKind kind);
  void setContent(format::SectionKind kind, std::vector<std::byte> raw);

  /// Overwrites a number in the content of a section.
  template <class T>
  void poke(format::SectionKind kind, std::size_t offset, T value) {
    auto raw = content(kind);
    const auto bytes = std::as_bytes(std::span(&value, 1));
    std::copy(bytes.begin(), bytes.end(), raw.begin() + std::ptrdiff_t(offset));
    setContent(kind, std::move(raw));
  }

  /// Puts the sections behind each other, with new offsets and checksums.
  [[nodiscard]] std::vector<std::byte> assemble();

  /// Writes header and table from `table` unchanged, with the sections at their offsets.
  [[nodiscard]] std::vector<std::byte> assembleAs(const format::SectionTable& table) const;

  /// The table of the last call of assemble().
  [[nodiscard]] const format::SectionTable& table() const { return table_; }

  std::uint16_t versionMajor, versionMinor;  ///< of the file that was taken apart

 private:
  format::SectionTable table_;
  std::vector<CraftedSection> sections_;
};

/// Counts the bytes requested from operator new (allocation_meter.cpp), which shows how much memory a hostile file makes a
/// reader take: those requested by this thread since the meter was made. Freed memory is not subtracted.
class AllocationMeter {
 public:
  AllocationMeter();
  [[nodiscard]] std::size_t bytes() const;

 private:
  std::size_t start_;
};

}  // namespace esvr::test
