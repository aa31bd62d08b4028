#pragma once
/// Finds the sections of a file by kind, grid and chunk, and knows which of them were never read.

#include <cstddef>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/memory_budget.h"
#include "esvr/container.h"
#include "format/bytes.h"
#include "format/section_table.h"

namespace esvr::format {

class SectionReader {
 public:
  /// \param limits  limits on the memory of the content
  /// \throws BadInput  the header or the section table is damaged
  explicit SectionReader(const ByteSource& source, const ReadLimits& limits = {});
  /// \param table  that of the source, which was checked
  SectionReader(const ByteSource& source, SectionTable table, const ReadLimits& limits);

  /// The table, with the rows of packed sections.
  [[nodiscard]] const SectionTable& table() const { return table_; }

  /// Number of sections of a kind.
  [[nodiscard]] std::uint32_t count(SectionKind kind) const;

  /// Start of the text of an error about a section, whether it exists or not.
  [[nodiscard]] std::string place(const SectionId& id) const;

  [[nodiscard]] bool has(const SectionId& id) const { return unread_.contains(id); }

  /// Bytes that a section takes in the file. It must exist.
  [[nodiscard]] std::uint64_t storedBytes(const SectionId& id) const;

  /// The memory that is left for content; get() takes from it. Bytes that sections share count for
  /// each of them, because each has a content of its own in memory.
  [[nodiscard]] MemoryBudget& budget() { return budget_; }

  /// Reads the content of a section. It can be called once for each section.
  /// \throws BadInput  the section is damaged or does not exist
  /// \throws MemoryExceeded  the content exceeds the budget
  [[nodiscard]] std::vector<std::byte> get(const SectionId& id);

  /// Reads the bytes of a carried grid, which may be too large for the heap, like get().
  [[nodiscard]] VoxelArray<std::byte> getCarried(const SectionId& id);

  /// Checks the checksum of a section whose content is not wanted. It is called instead of get().
  /// \throws BadInput  the section is damaged or does not exist
  void check(const SectionId& id);

  /// The first bytes of a section that is stored raw, at most `bytes`. Their checksum is not verified,
  /// which get() does. \throws BadInput  the section does not exist
  [[nodiscard]] std::vector<std::byte> peek(const SectionId& id, std::uint64_t bytes) const;

  /// Opens a section that is to be read piece by piece. It is called instead of get(), and once.
  /// \param whole  true: the whole section is read and checked now; false: nothing is checked yet
  /// \throws BadInput  the section is damaged, does not exist, or is compressed
  /// \throws MemoryExceeded  the whole section exceeds the budget
  [[nodiscard]] std::unique_ptr<ByteSource> open(const SectionId& id, bool whole);

  /// Checks what has not been read: the bytes between the sections, and the checksums of sections
  /// of unknown kinds.
  /// \throws BadInput  there is damage, or a section of a known kind belongs to nothing
  void finish();

 private:
  [[nodiscard]] std::size_t take(const SectionId& id);

  /// The table without the rows of packed sections.
  [[nodiscard]] SectionTable ownTable() const;
  [[nodiscard]] const SectionEntry& entryOf(const SectionId& id) const;

  const ByteSource& source_;
  SectionTable table_;
  std::size_t ownRows_;  ///< rows of the table that are not those of packed sections
  MemoryBudget budget_;
  std::map<SectionId, std::size_t> unread_;
};

// Whole containers (decode.cpp).

/// Decodes a whole container. \throws BadInput, MemoryExceeded
[[nodiscard]] EsvrFile decode(const ByteSource& source, const ReadLimits& limits = {});

/// Decodes the short form of a frame (frame_table.h).
/// \throws BadInput, MemoryExceeded
[[nodiscard]] EsvrFile decodeShort(std::span<const std::byte> bytes, const std::string& name,
                                   const ReadLimits& limits, const EsvrFile& previous);

/// Decodes a part of a container. \throws BadInput, MemoryExceeded
[[nodiscard]] PartOfFile decodePart(const ByteSource& source, const ReadPart& part);

}  // namespace esvr::format
