#include "format/table_check.h"

#include <algorithm>
#include <compare>
#include <set>

#include "esvr/error.h"
#include "format/codec.h"

namespace esvr::format {
namespace {

/// A range of bytes that belongs to a part of the file.
struct Region {
  std::uint64_t offset = 0, bytes = 0;
  friend constexpr auto operator<=>(const Region&, const Region&) = default;
};

/// The header, the table and the sections in their order in the file. Sections that share their
/// bytes are one region.
std::vector<Region> regionsOf(const SectionTable& table) {
  std::set<Placement> placements;
  for (const auto& e : table.entries) placements.insert(placementOf(e));
  std::vector<Region> regions{{0, kHeaderBytes},
                              {table.tableOffset, table.entries.size() * kEntryBytes}};
  for (const auto& p : placements) regions.push_back({p.offset, p.storedBytes});
  std::sort(regions.begin(), regions.end());
  return regions;
}

class TableCheck {
 public:
  TableCheck(const std::string& file, const SectionTable& table) : file_(file), table_(table) {}

  void checkPlaces() const {
    for (std::size_t i = 0; i < table_.entries.size(); ++i) checkPlace(i);
    checkOverlap();
  }
  void checkRows() const {
    for (std::size_t i = 0; i < table_.entries.size(); ++i) checkKind(i);
    checkUnique();
  }

 private:
  [[noreturn]] void fail(std::size_t entry, const std::string& what) const {
    throw BadInput(placeOf(file_, table_, entry) + ": " + what);
  }

  void checkPlace(std::size_t i) const {
    const auto& e = table_.entries[i];
    if (e.offset > table_.fileBytes || e.storedBytes > table_.fileBytes - e.offset)
      fail(i, std::to_string(e.storedBytes) + " bytes do not lie in the file");
    if (e.offset % kAlignment != 0) fail(i, "not aligned");
  }

  void checkKind(std::size_t i) const {
    const auto& e = table_.entries[i];
    const std::string version = " of " + versions(table_.versionMajor, table_.versionMinor);
    if (!known(e.id.kind)) {
      if (e.flags & kRequired) fail(i, "a kind of section that must be understood," + version);
      return;
    }
    if (!known(e.codec)) fail(i, "codec '" + nameOf(e.codec) + "'" + version);
    if ((e.flags & ~kRequired) || e.id.frame != 0 || e.id.layer != 0)
      fail(i, "flags " + std::to_string(e.flags) + ", frame " + std::to_string(e.id.frame) +
                  ", layer " + std::to_string(e.id.layer) + version);
    const bool isCarried = e.id.kind == SectionKind::kCarriedBytes;
    const bool isOfCarried = e.codec == Codec::kBlosc;
    if (e.codec != Codec::kRaw && isCarried != isOfCarried)
      fail(i, "codec '" + nameOf(e.codec) + "' is not that of " + nameOf(e.id.kind));
    if (!plausibleSizes(e.codec, e.storedBytes, e.rawBytes))
      fail(i, std::to_string(e.storedBytes) + " bytes cannot hold " + std::to_string(e.rawBytes));
  }

  void checkOverlap() const {
    const auto regions = regionsOf(table_);
    for (std::size_t i = 1; i < regions.size(); ++i)
      if (regions[i - 1].offset + regions[i - 1].bytes > regions[i].offset)
        throw BadInput(file_ + ": sections overlap at byte " + std::to_string(regions[i].offset));
  }

  void checkUnique() const {
    std::vector<SectionId> ids;
    for (const auto& e : table_.entries) ids.push_back(e.id);
    std::sort(ids.begin(), ids.end());
    const auto twice = std::adjacent_find(ids.begin(), ids.end());
    if (twice != ids.end()) throw BadInput(file_ + ": two sections are " + describe(*twice));
  }

  const std::string& file_;
  const SectionTable& table_;
};

void checkZero(const ByteSource& source, std::uint64_t begin, std::uint64_t end) {
  constexpr std::uint64_t kPiece = 1 << 16;
  for (; begin < end; begin += std::min(kPiece, end - begin)) {
    const auto bytes = source.read(begin, std::min(kPiece, end - begin));
    const auto at =
        std::find_if(bytes.begin(), bytes.end(), [](auto b) { return b != std::byte{}; });
    if (at != bytes.end())
      throw BadInput(source.name() + ": byte " +
                     std::to_string(begin + std::uint64_t(at - bytes.begin())) +
                     " belongs to no section and is not zero");
  }
}

}  // namespace

void checkTable(const std::string& file, const SectionTable& table) {
  TableCheck(file, table).checkPlaces();
  checkRows(file, table);
}

void checkRows(const std::string& file, const SectionTable& table) {
  TableCheck(file, table).checkRows();
}

void checkGaps(const ByteSource& source, const SectionTable& table) {
  std::uint64_t end = 0;
  for (const auto& region : regionsOf(table)) {
    checkZero(source, end, region.offset);
    end = region.offset + region.bytes;
  }
  checkZero(source, end, table.fileBytes);
}

}  // namespace esvr::format
