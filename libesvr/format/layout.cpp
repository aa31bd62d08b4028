#include "format/layout.h"

#include <cstdio>

namespace esvr::format {
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
    {SectionKind::kLevels, "levels"},
    {SectionKind::kSequenceIndex, "sequence index"},
};
constexpr Named<Codec> kCodecs[] = {{Codec::kRaw, "raw"},
                                    {Codec::kBytes, "bytes"},
                                    {Codec::kFloats, "floats"},
                                    {Codec::kBlosc, "blosc"}};

template <class Names, class Id>
const char* find(const Names& names, Id id) {
  for (const auto& named : names)
    if (named.id == id) return named.name;
  return nullptr;
}

template <class Names, class Id>
std::string nameIn(const Names& names, Id id) {
  if (const char* name = find(names, id)) return name;
  char text[24];
  std::snprintf(text, sizeof text, "unknown 0x%x", unsigned(id));
  return text;
}

}  // namespace

std::string nameOf(SectionKind kind) { return nameIn(kKinds, kind); }
std::string nameOf(Codec codec) { return nameIn(kCodecs, codec); }
bool known(SectionKind kind) { return find(kKinds, kind) != nullptr; }
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
    case SectionKind::kLevels:
      return 4;
    default:
      return 0;
  }
}
bool known(Codec codec) { return find(kCodecs, codec) != nullptr; }

}  // namespace esvr::format
