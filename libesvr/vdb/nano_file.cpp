#include "vdb/nano_file.h"

#include <blosc.h>
#include <nanovdb/NanoVDB.h>
#include <zlib.h>

#include <algorithm>

#include "esvr/error.h"
#include "esvr/memory_limit.h"

namespace esvr::vdb {
namespace {

constexpr std::uint64_t kMagicOld =
    0x304244566f6e614eu;  // "NanoVDB0": a file, and before 32.6 also a grid
constexpr std::uint64_t kMagicGrid = 0x314244566f6e614eu;  // "NanoVDB1"
constexpr std::uint64_t kMagicFile = 0x324244566f6e614eu;  // "NanoVDB2"

enum Codec : std::uint16_t { kNone = 0, kZip = 1, kBlosc = 2 };
constexpr std::uint64_t kBloscChunk = std::uint64_t{1} << 30;  // bytes before compression

struct SegmentHeader {
  std::uint64_t magic;
  std::uint32_t version;
  std::uint16_t gridCount;
  std::uint16_t codec;
};
static_assert(sizeof(SegmentHeader) == 16);

struct GridRow {
  std::uint64_t gridBytes, storedBytes, nameHash, activeVoxels;
  std::uint32_t gridType, gridClass;
  double worldBox[6];
  Box indexBox;
  double voxelSize[3];
  std::uint32_t nameBytes;
  std::uint32_t nodeCount[4];
  std::uint32_t tileCount[3];
  std::uint16_t codec, padding;
  std::uint32_t version;
};
static_assert(sizeof(GridRow) == 176);

std::uint32_t majorOf(std::uint32_t version) { return version >> 21; }

/// A version of NanoVDB in full, because the first ones have the major version 0: "0.0.28".
std::string versionText(std::uint32_t version) {
  constexpr std::uint32_t kMinorMask = (1u << 11) - 1, kPatchMask = (1u << 10) - 1;
  return std::to_string(majorOf(version)) + '.' + std::to_string((version >> 10) & kMinorMask) +
         '.' + std::to_string(version & kPatchMask);
}

SegmentHeader readSegmentHeader(InputFile& file) {
  const auto header = file.read<SegmentHeader>();
  if (header.magic == kMagicGrid)
    throw BadInput("is a bare NanoVDB grid without a file header: write it with nanovdb::io");
  if (header.magic != kMagicOld && header.magic != kMagicFile)
    throw BadInput("is damaged: no NanoVDB header where one should be");
  if (majorOf(header.version) != NANOVDB_MAJOR_VERSION_NUMBER)
    throw BadInput("was written by NanoVDB " + versionText(header.version) +
                   ", this program reads version " + std::to_string(NANOVDB_MAJOR_VERSION_NUMBER));
  return header;
}

NanoEntry readEntry(InputFile& file, std::uint16_t codec) {
  const auto row = file.read<GridRow>();
  const auto name = file.readBytes(row.nameBytes);
  NanoEntry entry;
  const auto end = std::find(name.begin(), name.end(), std::byte{0});
  entry.name.assign(reinterpret_cast<const char*>(name.data()), std::size_t(end - name.begin()));
  entry.gridType = row.gridType;
  entry.gridClass = row.gridClass;
  entry.activeVoxels = row.activeVoxels;
  if (row.activeVoxels > 0) entry.activeBox = row.indexBox;
  entry.codec = codec;
  entry.gridBytes = row.gridBytes;
  entry.storedBytes = row.storedBytes;
  return entry;
}

void unzip(InputFile& file, const NanoEntry& entry, NanoBuffer& to) {
  const auto packed = file.readBytes(file.read<std::uint64_t>());
  uLongf unpacked = to.size();
  const int status = uncompress(reinterpret_cast<Bytef*>(to.data()), &unpacked,
                                reinterpret_cast<const Bytef*>(packed.data()), packed.size());
  if (status != Z_OK || unpacked != entry.gridBytes)
    throw BadInput("is damaged: its zip data do not unpack");
}

void unblosc(InputFile& file, NanoBuffer& to) {
  for (std::uint64_t done = 0; done < to.size();) {
    const std::uint64_t raw = std::min<std::uint64_t>(to.size() - done, kBloscChunk);
    const auto packed = file.readBytes(file.read<std::uint64_t>());
    std::size_t announced = 0;
    if (packed.size() < BLOSC_MIN_HEADER_LENGTH ||
        blosc_cbuffer_validate(packed.data(), packed.size(), &announced) != 0 || announced != raw ||
        blosc_decompress_ctx(packed.data(), to.data() + done, raw, 1) != int(raw))
      throw BadInput("is damaged: its Blosc data do not unpack");
    done += raw;
  }
}

}  // namespace

bool beginsAsNanoVdb(InputFile& file) {
  if (file.size() < sizeof(SegmentHeader)) return false;
  file.seek(0);
  const auto magic = file.read<std::uint64_t>();
  return magic == kMagicOld || magic == kMagicGrid || magic == kMagicFile;
}

std::vector<NanoEntry> readNanoDirectory(InputFile& file) {
  std::vector<NanoEntry> entries;
  file.seek(0);
  while (file.remaining() > 0) {
    const auto header = readSegmentHeader(file);
    const std::size_t first = entries.size();
    for (int i = 0; i < header.gridCount; ++i) entries.push_back(readEntry(file, header.codec));
    for (std::size_t i = first; i < entries.size(); ++i) {
      entries[i].at = file.position();
      file.skip(entries[i].storedBytes);
    }
  }
  return entries;
}

NanoBuffer readNanoBuffer(InputFile& file, const NanoEntry& entry, std::uint64_t maxBytes) {
  file.seek(entry.at);
  if (entry.codec == kNone) file.need(entry.gridBytes);
  requireWithinMemory(double(entry.gridBytes), maxBytes, "it");
  NanoBuffer buffer(entry.gridBytes);
  switch (entry.codec) {
    case kNone:
      file.read(buffer.data(), buffer.size());
      break;
    case kZip:
      unzip(file, entry, buffer);
      break;
    case kBlosc:
      unblosc(file, buffer);
      break;
    default:
      throw BadInput("is packed by an unknown codec, number " + std::to_string(entry.codec));
  }
  return buffer;
}

}  // namespace esvr::vdb
