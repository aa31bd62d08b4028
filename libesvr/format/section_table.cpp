// The table of a file: the names of kinds and codecs, the rows, their checks, the codecs, and reading one section.

#include "format/section_table.h"

#include <algorithm>
#include <cstdio>
#include <set>
#include <utility>

#include "codec/range_coder.h"
#include "core/counted.h"
#include "core/parallel.h"
#include "esvr/error.h"

namespace esvr::format {

// ---- Names and versions

namespace {

template <class Id>
struct Named {
  Id id;
  const char* name;
};

constexpr Named<SectionKind> kKinds[] = {
    {SectionKind::kFileMetadata, "file metadata"},
    {SectionKind::kGrid, "grid"},
    {SectionKind::kChunks, "chunks"},
    {SectionKind::kBricks, "bricks"},
    {SectionKind::kCurve, "curve"},
    {SectionKind::kCarried, "carried grid"},
    {SectionKind::kVector, "vector grid"},
    {SectionKind::kGridRecords, "grid records"},
    {SectionKind::kPacked, "packed sections"},
    {SectionKind::kLayerErrors, "layer errors"},
    {SectionKind::kCenters, "centers"},
    {SectionKind::kScales, "scales"},
    {SectionKind::kRotations, "rotations"},
    {SectionKind::kIntensities, "intensities"},
    {SectionKind::kKappas, "kappas"},
    {SectionKind::kEllipsoids, "ellipsoids"},
    {SectionKind::kLayered, "layered ellipsoids"},
    {SectionKind::kMask, "mask"},
    {SectionKind::kVoxels, "voxels"},
    {SectionKind::kResidual, "residual"},
    {SectionKind::kCarriedBytes, "carried bytes"},
    {SectionKind::kPredicted, "predicted grid"},
    {SectionKind::kRelated, "related voxels"},
    {SectionKind::kNonFinite, "non-finite voxels"},
    {SectionKind::kSequenceIndex, "sequence index"},
};
constexpr Named<Codec> kCodecs[] = {{Codec::kRaw, "raw"},
                                    {Codec::kBytes, "bytes"},
                                    {Codec::kFloats, "floats"},
                                    {Codec::kBlosc, "blosc"}};

template <class Names, class Id>
const char* findName(const Names& names, Id id) {
  for (const auto& named : names)
    if (named.id == id) return named.name;
  return nullptr;
}

template <class Names, class Id>
std::string nameIn(const Names& names, Id id) {
  if (const char* name = findName(names, id)) return name;
  char text[24];
  std::snprintf(text, sizeof text, "unknown 0x%x", unsigned(id));
  return text;
}

}  // namespace

std::string nameOf(SectionKind kind) { return nameIn(kKinds, kind); }
std::string nameOf(Codec codec) { return nameIn(kCodecs, codec); }
bool known(SectionKind kind) { return findName(kKinds, kind) != nullptr; }
std::uint16_t minorVersionOf(SectionKind kind) {
  switch (kind) {
    case SectionKind::kCarried:
    case SectionKind::kCarriedBytes:
      return 1;
    case SectionKind::kVector:
      return 2;
    case SectionKind::kPredicted:
    case SectionKind::kSequenceIndex:
      return 3;
    case SectionKind::kGridRecords:
    case SectionKind::kPacked:
    case SectionKind::kRelated:
      return 4;
    case SectionKind::kNonFinite:
      return 6;
    default:
      return 0;
  }
}
bool known(Codec codec) { return findName(kCodecs, codec) != nullptr; }

// ---- Checks of a table

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
      fail(i, "no room for its " + counted(e.storedBytes, "byte") + " in the file");
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
      fail(i, counted(e.storedBytes, "byte") + " cannot hold " + std::to_string(e.rawBytes));
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

}  // namespace

void checkTable(const std::string& file, const SectionTable& table) {
  TableCheck(file, table).checkPlaces();
  checkRows(file, table);
}

void checkRows(const std::string& file, const SectionTable& table) {
  TableCheck(file, table).checkRows();
}

void checkZero(const ByteSource& source, std::uint64_t begin, std::uint64_t end) {
  constexpr std::uint64_t kPiece = 1 << 16;
  for (; begin < end; begin += std::min(kPiece, end - begin)) {
    const auto bytes = source.read(begin, std::min(kPiece, end - begin));
    const auto at =
        std::find_if(bytes.begin(), bytes.end(), [](auto b) { return b != std::byte{}; });
    if (at != bytes.end())
      throw BadInput(source.name() + ": byte " +
                     std::to_string(begin + std::uint64_t(at - bytes.begin())) +
                     " belongs to no part and is not zero");
  }
}

void checkGaps(const ByteSource& source, const SectionTable& table) {
  std::uint64_t end = 0;
  for (const auto& region : regionsOf(table)) {
    checkZero(source, end, region.offset);
    end = region.offset + region.bytes;
  }
  checkZero(source, end, table.fileBytes);
}

// ---- The header and the rows

namespace {

struct Header {
  std::uint16_t versionMajor = 0, versionMinor = 0;
  std::uint32_t sections = 0;
  std::uint64_t fileBytes = 0, tableOffset = 0, tableChecksum = 0;
};

template <class Side>
void codeEntry(Side& side, Coded<Side, SectionEntry>& e) {
  codeAs<std::uint32_t>(side, e.id.kind);
  codeAs<std::uint16_t>(side, e.codec);
  code(side, e.flags);
  for (auto* index : {&e.id.grid, &e.id.chunk, &e.id.frame, &e.id.layer}) code(side, *index);
  for (auto* size : {&e.offset, &e.storedBytes, &e.rawBytes, &e.checksum}) code(side, *size);
}

void checkMagic(const ByteSource& source) {
  const auto n = std::min<std::uint64_t>(source.size(), kMagic.size());
  const auto bytes = source.read(0, n);
  const auto magic = std::as_bytes(std::span(kMagic));
  const auto differs = std::mismatch(bytes.begin(), bytes.end(), magic.begin()).first;
  if (differs - bytes.begin() == std::ptrdiff_t(kMagic.size())) return;
  // The first five bytes name the format; the line ends after them show how a transfer changed
  // them.
  if (differs - bytes.begin() >= 5 && n == kMagic.size())
    throw BadInput(source.name() + ": damaged by a transfer as text: its line ends were changed");
  throw BadInput(source.name() + ": not an .esvr file");
}

Header readHeader(const ByteSource& source) {
  checkMagic(source);
  const auto bytes = source.read(0, kHeaderBytes);
  const auto afterMagic = std::span(bytes).subspan(kMagic.size());
  ByteReader in(afterMagic, source.name() + ": header");
  Header h;
  h.versionMajor = in.get<std::uint16_t>();
  h.versionMinor = in.get<std::uint16_t>();
  if (h.versionMajor != kVersionMajor)  // before the checksum, which may be elsewhere there
    throw BadInput(source.name() + ": " + versions(h.versionMajor, h.versionMinor));
  h.sections = in.get<std::uint32_t>();
  h.fileBytes = in.get<std::uint64_t>();
  h.tableOffset = in.get<std::uint64_t>();
  h.tableChecksum = in.get<std::uint64_t>();
  if (in.get<std::uint64_t>() != checksum(std::span(bytes).first(kHeaderChecksumAt)))
    in.fail("checksum does not match");
  return h;
}

void checkSize(const ByteSource& source, const Header& h) {
  if (source.size() == h.fileBytes) return;
  if (h.fileBytes == 0)
    throw BadInput(source.name() + ": not complete: the program that wrote it was interrupted");
  const bool shorter = source.size() < h.fileBytes;
  throw BadInput(source.name() + (shorter ? ": truncated: " : ": has bytes after its end: ") +
                 counted(source.size(), "byte") + " where its header says " +
                 std::to_string(h.fileBytes));
}

void checkTablePlace(const ByteSource& source, const Header& h) {
  const bool begins = h.tableOffset >= kHeaderBytes && h.tableOffset <= h.fileBytes &&
                      h.tableOffset % kAlignment == 0;
  if (!begins || h.sections > (h.fileBytes - h.tableOffset) / kEntryBytes)
    throw BadInput(source.name() + ": the section table (" + std::to_string(h.sections) +
                   " sections at byte " + std::to_string(h.tableOffset) +
                   ") does not lie in the file");
}

}  // namespace

Placement placementOf(const SectionEntry& e) {
  return {e.offset, e.storedBytes, e.rawBytes, e.checksum, e.id.kind, e.codec, e.flags};
}

bool isSequence(const SectionTable& table) {
  return std::ranges::any_of(table.entries, [](const SectionEntry& entry) {
    return entry.id.kind == SectionKind::kSequenceIndex;
  });
}

std::string describe(const SectionId& id) {
  std::string text = nameOf(id.kind);
  if (id.grid != kNone) text += " of grid " + std::to_string(id.grid);
  if (id.chunk != kNone) text += ", chunk " + std::to_string(id.chunk);
  return text;
}

std::string versions(std::uint16_t versionMajor, std::uint16_t versionMinor) {
  const auto text = [](unsigned a, unsigned b) {
    return std::to_string(a) + "." + std::to_string(b);
  };
  return "format " + text(versionMajor, versionMinor) + ", this reader knows " +
         text(kVersionMajor, kVersionMinor);
}

std::string placeOf(const std::string& file, const SectionTable& table, std::size_t entry) {
  const auto& e = table.entries[entry];
  return file + ": section " + std::to_string(entry) + " (" + describe(e.id) + ", at byte " +
         std::to_string(e.offset) + ")";
}

std::vector<std::byte> encodeTable(const SectionTable& table) {
  ByteWriter rows;
  for (const auto& e : table.entries) codeEntry(rows, e);

  ByteWriter out;
  out.putAll(kMagic);
  out.put(table.versionMajor);
  out.put(table.versionMinor);
  out.put(std::uint32_t(table.entries.size()));
  out.put(table.fileBytes);
  out.put(table.tableOffset);
  out.put(checksum(rows.bytes()));
  out.put(checksum(out.bytes()));
  out.putAll(rows.bytes());
  return out.take();
}

SectionTable readTable(const ByteSource& source) {
  const Header h = readHeader(source);
  checkSize(source, h);
  checkTablePlace(source, h);
  const auto rows = source.read(h.tableOffset, h.sections * kEntryBytes);
  ByteReader in(rows, source.name() + ": section table");
  if (checksum(rows) != h.tableChecksum) in.fail("checksum does not match");

  SectionTable table{h.versionMajor, h.versionMinor, h.fileBytes, h.tableOffset, {}, false};
  for (std::uint32_t i = 0; i < h.sections; ++i) codeEntry(in, table.entries.emplace_back());
  checkTable(source.name(), table);
  return table;
}

// ---- Codecs

namespace {

/// Bytes that compression must save. Sections lie at multiples of it, so that less saves nothing.
constexpr std::uint64_t kMinSaving = kAlignment;

/// Limits on the ratio of content to stored bytes, so that a small file cannot ask a reader for much memory
/// or time. Lists of positions reach 50; the writer adds zeros where content is compressed further. Zeros in
/// Blosc's blocks reach half of its limit, and the writer stores raw what is above.
constexpr std::uint64_t kMaxRatio = 1024, kMaxBloscRatio = 16384;

/// Bytes of an f32 that are stored as they are. Those of a fit are noise, and only the highest byte, which
/// has the sign and most of the exponent, can be compressed.
constexpr std::size_t kLowBytes = sizeof(float) - 1;

/// Bytes on which the codec of floats is compared with that of bytes. The latter is better for numbers of
/// few digits, which no fit makes.
constexpr std::size_t kSample = std::size_t{1} << 16;

std::vector<std::byte> codedFloats(std::span<const std::byte> raw) {
  std::vector<std::byte> stored, high;
  for (std::size_t i = 0; i < raw.size(); ++i)
    (i % sizeof(float) == kLowBytes ? high : stored).push_back(raw[i]);
  const auto coded = codec::encodeBytes(high);
  stored.insert(stored.end(), coded.begin(), coded.end());
  return stored;
}

Packed chosen(Codec codec, std::vector<std::byte> packed, std::vector<std::byte> raw) {
  const std::uint64_t rawBytes = raw.size();
  if (packed.size() + kMinSaving > rawBytes) return {Codec::kRaw, std::move(raw), rawBytes};
  return {codec, std::move(packed), rawBytes};
}

std::vector<std::byte> unpackFloats(std::span<const std::byte> stored, std::uint64_t rawBytes) {
  const std::uint64_t count = rawBytes / sizeof(float);
  const auto high = codec::decodeBytes(stored.subspan(count * kLowBytes), count);
  std::vector<std::byte> raw(rawBytes);
  for (std::uint64_t i = 0; i < count; ++i) {
    std::ranges::copy(stored.subspan(i * kLowBytes, kLowBytes),
                      raw.begin() + std::ptrdiff_t(i * sizeof(float)));
    raw[i * sizeof(float) + kLowBytes] = high[i];
  }
  return raw;
}

}  // namespace

Packed pack(std::vector<std::byte> raw) {
  auto packed = codec::encodeBytes(raw);
  packed.resize(std::max<std::uint64_t>(packed.size(), raw.size() / kMaxRatio));
  return chosen(Codec::kBytes, std::move(packed), std::move(raw));
}

Packed packFloats(std::vector<std::byte> raw) {
  const auto start = std::span(raw).first(std::min(raw.size(), kSample));
  if (codec::encodeBytes(start).size() < codedFloats(start).size()) return pack(std::move(raw));
  auto packed = codedFloats(raw);
  return chosen(Codec::kFloats, std::move(packed), std::move(raw));
}

bool plausibleSizes(Codec codec, std::uint64_t storedBytes, std::uint64_t rawBytes) {
  if (codec == Codec::kRaw) return storedBytes == rawBytes;
  if (codec == Codec::kFloats)
    return rawBytes % sizeof(float) == 0 && rawBytes / sizeof(float) * kLowBytes <= storedBytes;
  return rawBytes / (codec == Codec::kBlosc ? kMaxBloscRatio : kMaxRatio) <= storedBytes;
}

std::vector<std::byte> unpack(Codec codec, std::vector<std::byte> stored, std::uint64_t rawBytes,
                              const std::string& where) {
  switch (codec) {
    case Codec::kRaw:
      return stored;
    case Codec::kBytes:
      return codec::decodeBytes(stored, rawBytes);
    case Codec::kFloats:
      return unpackFloats(stored, rawBytes);
    case Codec::kBlosc:
      break;
  }
  throw BadInput(where + ": Blosc compresses the bytes of carried grids only");
}

// ---- Reading sections

void forEachPiece(const ByteSource& source, const SectionEntry& entry,
                  const std::function<void(std::span<const std::byte>)>& use) {
  constexpr std::uint64_t kPieceBytes = 1 << 20;
  const std::uint64_t end = entry.offset + entry.storedBytes;
  for (std::uint64_t at = entry.offset; at < end; at += std::min(kPieceBytes, end - at)) {
    throwIfCancelled();
    use(source.read(at, std::min(kPieceBytes, end - at)));
  }
}

void checkStored(const ByteSource& source, const SectionTable& table, std::size_t entry) {
  RunningChecksum sum;
  forEachPiece(source, table.entries[entry], [&](auto piece) { sum.add(piece); });
  if (sum.value() != table.entries[entry].checksum)
    throw BadInput(placeOf(source.name(), table, entry) + ": checksum does not match");
}

std::vector<std::byte> readStored(const ByteSource& source, const SectionTable& table,
                                  std::size_t entry) {
  const auto& e = table.entries[entry];
  auto stored = source.read(e.offset, e.storedBytes);
  if (checksum(stored) != e.checksum)
    throw BadInput(placeOf(source.name(), table, entry) + ": checksum does not match");
  return stored;
}

std::vector<std::byte> readSection(const ByteSource& source, const SectionTable& table,
                                   std::size_t entry) {
  const auto& e = table.entries[entry];
  return unpack(e.codec, readStored(source, table, entry), e.rawBytes,
                placeOf(source.name(), table, entry));
}

}  // namespace esvr::format
