#pragma once
/// Takes an .esvr file apart, so that a test can change a part and assemble the file with correct
/// checksums. Such damage is found by the reader's own checks only.

#include <cstddef>
#include <cstdint>
#include <vector>

#include "format/section_table.h"

namespace esvr::test {

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

}  // namespace esvr::test
