#pragma once
/// Collects the sections of a file or of a frame that is being written, and stores equal sections once.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "esvr/container.h"
#include "esvr/quantised.h"
#include "esvr/volume.h"
#include "format/frame_table.h"
#include "format/section_table.h"

namespace esvr::format {

class SectionWriter {
 public:
  /// Compresses content and adds its section.
  void add(const SectionId& id, std::uint16_t flags, std::vector<std::byte> content);

  /// Adds a section whose content is coded already.
  void addRaw(const SectionId& id, std::uint16_t flags, std::vector<std::byte> content);

  /// Adds a section whose content is coded or compressed already.
  void addPacked(const SectionId& id, std::uint16_t flags, Packed packed);

  /// Codes voxels and adds their section. Voxels that equal those of an earlier call, bit for bit,
  /// are not coded again, because coding takes long.
  /// \param layer  must outlive the writer
  void addVoxels(const SectionId& id, const VoxelLayer& layer);

  /// Adds a section of the bytes of a carried grid, which may be too large for the heap.
  void addCarried(const SectionId& id, const VoxelArray<std::byte>& content);

  /// kCompact: small sections are packed (frame_table.h) if that makes the file smaller.
  void setLayout(FileLayout layout) { layout_ = layout; }
  [[nodiscard]] FileLayout layout() const { return layout_; }

  /// Gives the file at least this minor version, which something in its sections needs.
  void requireVersion(std::uint16_t minor) {
    leastVersion_ = std::max(leastVersion_, minor);
    table_.versionMinor = std::max(table_.versionMinor, minor);
  }

  using Sink = std::function<void(std::span<const std::byte>)>;
  /// Passes the file to the sink, piece by piece. Sections that are stored alike share their bytes.
  /// \return the size of the file
  std::uint64_t writeTo(const Sink& sink) const;

  /// The file in memory.
  [[nodiscard]] std::vector<std::byte> assemble() const;
  /// The short form of a frame in memory.
  [[nodiscard]] std::vector<std::byte> assembleFrame(const Inherited& inherited) const;

  /// Bytes of the sections with their padding and their rows of the table, if none shared bytes.
  [[nodiscard]] std::uint64_t bytesUnshared() const;

 private:
  /// Rows, and the contents that they refer to.
  struct Arrangement {
    SectionTable table;
    std::vector<std::byte> packed{};  ///< content of the first row, if sections are packed
    std::vector<std::span<const std::byte>> contents{};
    std::vector<std::size_t> numbers{};    ///< by content: number of the caller
    std::vector<std::size_t> contentOf{};  ///< by row: index in `contents`

    /// \param number  that of the content; equal for rows that share it
    void add(const SectionEntry& row, std::span<const std::byte> content, std::size_t number);
    [[nodiscard]] std::uint64_t bytes() const;
  };

  /// Stored bytes, in one of two kinds of memory.
  struct Content {
    std::vector<std::byte> heap;
    VoxelArray<std::byte> large;
    [[nodiscard]] std::span<const std::byte> bytes() const;
  };

  /// \param entry  without its size and its checksum
  void addContent(SectionEntry entry, Content content);
  [[nodiscard]] std::size_t indexOf(const SectionEntry& entry, Content content);
  [[nodiscard]] std::span<const std::byte> contentOfRow(std::size_t row) const;
  [[nodiscard]] Arrangement plain() const;
  [[nodiscard]] Arrangement packed() const;
  /// The arrangement of the layout.
  [[nodiscard]] Arrangement arranged() const;

  FileLayout layout_ = FileLayout::kPlain;
  std::uint16_t leastVersion_ = 0;
  SectionTable table_{.versionMinor = 0};             ///< the lowest version that has all kinds
  std::vector<Content> contents_;                     ///< stored bytes without repetitions
  std::vector<std::size_t> contentOf_;                ///< index in contents_ of each entry
  std::multimap<Placement, std::size_t> contentsBy_;  ///< index in contents_, by offset 0
  std::vector<std::pair<const VoxelLayer*, std::size_t>> coded_;  ///< voxels, index in contents_
};

// The content of files and frames (encode.cpp).

/// The order of a chunk's ellipsoids in the file. Neighbours in space are neighbours in the
/// streams, which then compress better and are evaluated with fewer cache misses.
///
/// Returns the ellipsoids in Morton order of their centers, which must be finite. Ellipsoids of one
/// cell keep their order, so that sorting again changes nothing.
[[nodiscard]] Ellipsoids inMortonOrder(const Ellipsoids& ellipsoids);

/// The sections of a file, which must outlive them.
/// \throws RuntimeFailure  as for encodeEsvr
[[nodiscard]] SectionWriter sectionsOf(const EsvrFile& file);

/// The sections of a frame that refers to the previous one.
struct FrameSections {
  SectionWriter sections;
  Inherited inherited;
};
/// \return nothing if no grid is smaller as a difference from the previous frame
/// \throws RuntimeFailure  as for encodeEsvr
[[nodiscard]] std::optional<FrameSections> differencesOf(const EsvrFile& frame,
                                                         const EsvrFile& previous);

/// Largest number of bytes that the section of voxels which are not finite adds to a file; 0 if the grid needs none.
[[nodiscard]] std::uint64_t bytesOfNonFinite(const StoredGrid& grid);

/// The difference of a grid from that of the previous frame, if it takes fewer bytes in a frame than
/// the grid.
/// \param ownBytes  bytes of the grid without a previous frame
[[nodiscard]] std::optional<std::vector<std::byte>> differenceOf(const StoredGrid& grid,
                                                                 const StoredGrid& previous,
                                                                 std::uint64_t ownBytes);

}  // namespace esvr::format
