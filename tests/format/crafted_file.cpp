#include "format/crafted_file.h"

#include <algorithm>
#include <stdexcept>

#include "format/bytes.h"
#include "format/section_table.h"

namespace esvr::test {

using namespace format;

CraftedFile::CraftedFile(const std::vector<std::byte>& bytes) {
  const MemorySource source(bytes, "crafted");
  const SectionTable table = readTable(source);
  versionMajor = table.versionMajor;
  versionMinor = table.versionMinor;
  for (std::size_t i = 0; i < table.entries.size(); ++i)
    sections_.push_back({table.entries[i], readStored(source, table, i)});
}

CraftedSection& CraftedFile::section(SectionKind kind) {
  const auto it = std::find_if(sections_.begin(), sections_.end(),
                               [kind](const auto& s) { return s.entry.id.kind == kind; });
  if (it == sections_.end()) throw std::logic_error("no such section in the crafted file");
  return *it;
}

void CraftedFile::erase(SectionKind kind) {
  sections_.erase(sections_.begin() + (&section(kind) - sections_.data()));
}

CraftedSection& CraftedFile::add(const SectionId& id, std::uint16_t flags,
                                 std::vector<std::byte> stored) {
  SectionEntry entry{id, Codec::kRaw, flags, 0, 0, stored.size(), 0};
  sections_.push_back({entry, std::move(stored)});
  return sections_.back();
}

std::vector<std::byte> CraftedFile::content(SectionKind kind) {
  const auto& s = section(kind);
  return unpack(s.entry.codec, s.stored, s.entry.rawBytes, "crafted");
}

void CraftedFile::setContent(SectionKind kind, std::vector<std::byte> raw) {
  auto& s = section(kind);
  s.entry.codec = Codec::kRaw;
  s.entry.rawBytes = raw.size();
  s.stored = std::move(raw);
}

std::vector<std::byte> CraftedFile::assemble() {
  table_ = {versionMajor, versionMinor, 0, kHeaderBytes, {}};
  std::uint64_t end = kHeaderBytes + sections_.size() * kEntryBytes;
  for (auto& s : sections_) {
    s.entry.offset = alignUp(end);
    s.entry.storedBytes = s.stored.size();
    s.entry.checksum = checksum(s.stored);
    end = s.entry.offset + s.entry.storedBytes;
    table_.entries.push_back(s.entry);
  }
  table_.fileBytes = end;
  return assembleAs(table_);
}

std::vector<std::byte> CraftedFile::assembleAs(const SectionTable& table) const {
  auto bytes = encodeTable(table);
  bytes.resize(std::max<std::size_t>(bytes.size(), table_.fileBytes));
  for (const auto& s : sections_)
    std::copy(s.stored.begin(), s.stored.end(), bytes.begin() + std::ptrdiff_t(s.entry.offset));
  return bytes;
}

}  // namespace esvr::test
