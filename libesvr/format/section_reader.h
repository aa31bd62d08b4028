#pragma once
/// Hands out a file's sections by what they are of, and knows which were never asked for.

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "core/memory_budget.h"
#include "format/byte_source.h"
#include "format/section_table.h"

namespace esvr::format {

class SectionReader {
 public:
  /// \param maxBytes  of memory that the content may take
  /// \throws BadInput  header or table damaged
  explicit SectionReader(const ByteSource& source, std::uint64_t maxBytes = kNoMemoryLimit);

  [[nodiscard]] const SectionTable& table() const { return table_; }

  /// Number of sections of one kind.
  [[nodiscard]] std::uint32_t count(SectionKind kind) const;

  /// Begins errors about a section, whether it is there or not.
  [[nodiscard]] std::string place(const SectionId& id) const;

  [[nodiscard]] bool has(const SectionId& id) const { return unread_.contains(id); }

  /// The memory that is left for content. get() takes from it.
  [[nodiscard]] MemoryBudget& budget() { return budget_; }

  /// A section's content; each can be had once.
  /// \throws BadInput  damaged; there is none; MemoryExceeded
  [[nodiscard]] std::vector<std::byte> get(const SectionId& id);

  /// A section to be read piece by piece; instead of get(), and like it once.
  /// \param whole  read and check all of it now; else nothing of it is checked yet
  /// \throws BadInput  damaged; there is none; it is compressed
  [[nodiscard]] std::unique_ptr<ByteSource> open(const SectionId& id, bool whole);

  /// Checks what has not been read: bytes between the sections, checksums of unknown sections.
  /// \throws BadInput  damaged; a known section that belongs to nothing
  void finish();

 private:
  [[nodiscard]] std::size_t take(const SectionId& id);

  const ByteSource& source_;
  SectionTable table_;
  MemoryBudget budget_;
  std::map<SectionId, std::size_t> unread_;
};

}  // namespace esvr::format
