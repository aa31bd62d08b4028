// The sections of a chunk's ellipsoids: blocks of quantised ellipsoids, with their lattice and their boxes, the bytes that
// layers and streams take, and the sections themselves.

#include "format/ellipsoid_sections.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <numeric>
#include <type_traits>

#include "codec/brick_coder.h"
#include "codec/lattice.h"
#include "codec/range_coder.h"
#include "core/counted.h"
#include "core/geometry.h"
#include "core/parallel.h"
#include "esvr/container.h"
#include "esvr/error.h"

namespace esvr {
namespace format {

// ---- Boxes

namespace {

using Vec3 = std::array<double, 3>;

std::int32_t clampedFloor(double v) {
  return std::int32_t(std::clamp(std::floor(v), double(Box::kMin), double(Box::kMax)));
}
std::int32_t clampedCeil(double v) {
  return std::int32_t(std::clamp(std::ceil(v), double(Box::kMin), double(Box::kMax)));
}

Vec3 centerOf(const Chunk& chunk, std::size_t i) {
  const auto& c = chunk.ellipsoids.center;
  return {chunk.origin.x + double(c[0][i]), chunk.origin.y + double(c[1][i]),
          chunk.origin.z + double(c[2][i])};
}

/// Grows the box by [center - half, center + half].
void expand(Box& box, const Vec3& center, const Vec3& half) {
  box.expand(Coord{clampedFloor(center[0] - half[0]), clampedFloor(center[1] - half[1]),
                   clampedFloor(center[2] - half[2])});
  box.expand(Coord{clampedCeil(center[0] + half[0]), clampedCeil(center[1] + half[1]),
                   clampedCeil(center[2] + half[2])});
}

/// Half widths of an ellipsoid's bounding box for a support radius of 1: the lengths of the rows of
/// R S.
Vec3 unitHalfWidths(const Ellipsoids& e, std::size_t i) {
  const Matrix3 R =
      rotationOf({e.rotation[0][i], e.rotation[1][i], e.rotation[2][i], e.rotation[3][i]});
  Vec3 half{};
  for (std::size_t a = 0; a < 3; ++a) {
    for (std::size_t j = 0; j < 3; ++j)
      half[a] = std::hypot(half[a], R[3 * a + j] * std::exp(double(e.logScale[j][i])));
    // A scale that overflows gives 0 * inf; the box is then unbounded.
    if (std::isnan(half[a])) half[a] = HUGE_VAL;
  }
  return half;
}

/// The radius of the support; 0 for the paper's kernel at a negative kappa, whose support is empty.
double radiusOf(const Kernel& kernel, double kappa) {
  const double radius = supportRadius(kernelConstants<double>(kernel, kappa));
  return radius > 0.0 ? radius : 0.0;
}

}  // namespace

Box supportBox(const Chunk& chunk, Run run, const Kernel& kernel) {
  const auto& e = chunk.ellipsoids;
  const double sceneRadius = radiusOf(kernel, kernel.kappa);
  Box box;
  for (std::size_t i = run.first; i < run.first + run.count; ++i) {
    const double radius = e.kappa.empty() ? sceneRadius : radiusOf(kernel, e.kappa[i]);
    Vec3 half = unitHalfWidths(e, i);
    for (double& h : half) h = radius > 0.0 ? h * radius : 0.0;
    expand(box, centerOf(chunk, i), half);
  }
  return box;
}

Box centerBox(const Chunk& chunk, Run run) {
  Box box;
  for (std::size_t i = run.first; i < run.first + run.count; ++i)
    expand(box, centerOf(chunk, i), {});
  return box;
}

// ---- The lattice

namespace {

constexpr int kMaxOffset = 1 << 20;  // limit on offsets of bits, for sums in 32 bits
constexpr int kMaxSlope = 1 << 12;

template <class Side>
void codeWithin(Side& side, Coded<Side, int>& n, int limit, const char* what) {
  codeAs<std::int32_t>(side, n);
  if constexpr (Side::kReads)
    if (n < -limit || n > limit) side.fail(std::string(what) + " of the lattice is out of range");
}

template <class Side>
void codeStep(Side& side, Coded<Side, double>& step, const char* what) {
  code(side, step);
  if constexpr (Side::kReads)
    if (!(std::isfinite(step) && step > 0.0))
      side.fail(std::string(what) + " of the lattice is not a positive number");
}

template <class Side>
void codeLattice(Side& side, Coded<Side, Lattice>& l) {
  codeStep(side, l.cell, "the cell");
  codeCoord(side, l.lowestCell);
  codeStep(side, l.scaleStep, "the step of scales");
  code(side, l.lowestScale);
  codeStep(side, l.intensityStep, "the step of intensities");
  codeWithin(side, l.positionBase, kMaxOffset, "the base of positions");
  codeWithin(side, l.positionSlope, kMaxSlope, "the slope of positions");
  codeWithin(side, l.scaleOffset, kMaxOffset, "the offset of scales");
  codeWithin(side, l.intensityBase, kMaxOffset, "the base of intensities");
  codeWithin(side, l.intensitySlope, kMaxSlope, "the slope of intensities");
  codeWithin(side, l.rotationOffset, kMaxOffset, "the offset of rotations");
  codeAs<std::uint8_t>(side, l.cellBits);
  codeFlag(side, l.signedIntensity, "mark of signs");
  auto ratios = std::uint8_t(l.rotationFrom.size());
  code(side, ratios);
  if constexpr (Side::kReads) {
    if (l.cellBits > Lattice::kMaxCellBits) side.fail("the lattice has too many cells");
    l.rotationFrom.resize(ratios);
  }
  for (auto& from : l.rotationFrom) code(side, from);
}

}  // namespace

// ---- Blocks

namespace {

constexpr std::size_t kContexts = 8;
std::size_t context(std::uint32_t value) { return std::min<std::size_t>(value, kContexts - 1); }

/// The size of an ellipsoid as a context of its intensity: large ellipsoids are usually faint.
constexpr std::size_t kSizes = 24;
std::size_t sizeContext(const CoarseScales& s) {
  return std::min<std::size_t>((3 * s.low + 2 * s.middle + s.high) / 2, kSizes - 1);
}

void require(bool holds, const char* what) {
  if (!holds) throw BadInput(std::string(what) + " lies outside the lattice");
}

/// Encodes or decodes a run: first the position cells of all ellipsoids, then the other values,
/// ellipsoid by ellipsoid.
template <class Side>
class BlockCoder {
 public:
  BlockCoder(std::array<Side, kStreams>& sides, QuantisedEllipsoids& q) : sides_(sides), q_(q) {}

  void code(Run run) {
    auto keys = keysOf(run);
    codec::CellTree<Side>(sides_[0]).code(keys, 3 * q_.lattice.cellBits);
    for (std::size_t k = 0; k < run.count; ++k) {
      const std::size_t i = run.first + k;
      const CoarseScales s = codeCoarseScales(i);
      codeIntensity(s, i);
      codePrecision(i);
      codeScaleRests(s, i);
      codeRotation(s, i);
      codePlace(shapeBits(q_, i).position, keys[k], i);
    }
  }

 private:
  static constexpr bool kReads = std::is_same_v<Side, codec::Reader>;

  std::vector<std::uint64_t> keysOf(Run run) const {
    std::vector<std::uint64_t> keys(run.count);
    if constexpr (!kReads)
      for (std::size_t k = 0; k < run.count; ++k) keys[k] = keyOf(run.first + k);
    return keys;
  }

  [[nodiscard]] std::uint64_t keyOf(std::size_t i) const {
    const AxisBits bits = shapeBits(q_, i).position;
    std::uint64_t key = 0;
    for (std::size_t a = 0; a < 3; ++a) key |= spreadBits(q_.position[a][i] >> bits[a]) << a;
    return key;
  }

  std::uint32_t codeCoarse(codec::NumberModel& model, std::uint32_t value) {
    const std::uint32_t coarse = model.code(sides_[1], value);
    require(coarse <= Lattice::kMaxCoarseScale, "a scale");
    return coarse;
  }

  CoarseScales codeCoarseScales(std::size_t i) {
    CoarseScales s{};
    if constexpr (!kReads) s = coarseScales(q_, i);
    s.low = codeCoarse(low_[context(lowBefore_)], s.low);
    s.middle = codeCoarse(middle_[context(s.low)], s.middle);
    s.high = codeCoarse(high_[context(s.low + s.middle)], s.high);
    lowBefore_ = s.low;
    return s;
  }

  void codeIntensity(const CoarseScales& s, std::size_t i) {
    std::int32_t& value = q_.intensity[i];
    bool negative = value < 0;
    if (q_.lattice.signedIntensity) negative = sides_[3].bit(sign_, negative);
    const auto written = std::uint32_t(value < 0 ? -1 - value : value);
    const std::uint32_t magnitude = magnitude_[sizeContext(s)].code(sides_[3], written);
    require(magnitude <= Lattice::kMaxIntensity, "an intensity");
    value = negative ? -1 - std::int32_t(magnitude) : std::int32_t(magnitude);
  }

  void codePrecision(std::size_t i) {
    const std::int32_t value = q_.intensity[i];
    const auto magnitude = std::uint32_t(value < 0 ? -1 - value : value);
    auto& model = precision_[std::size_t(std::bit_width(magnitude))];
    q_.precision[i] = std::uint8_t(model.code(sides_[3], q_.precision[i]));
  }

  void codeScaleRests(const CoarseScales& s, std::size_t i) {
    const int bits = scaleBits(q_.lattice, q_.precision[i]);
    const std::uint32_t coarse[] = {s.low, s.middle, s.high};
    for (std::size_t a = 0; a < 3; ++a) {
      std::uint32_t rest = bits > 0 ? q_.scale[a][i] & ((1u << bits) - 1u) : 0u;
      rest = codeRest(a, coarse[a], rest, bits);
      q_.scale[a][i] = coarse[a] << bits | rest;
    }
  }

  /// Codes the lower bits of a scale. The highest one has a model; the others are as good as random
  /// and are stored raw.
  std::uint32_t codeRest(std::size_t axis, std::uint32_t coarse, std::uint32_t rest, int bits) {
    if (bits == 0) return 0;
    const std::uint32_t top =
        sides_[1].bit(rest_[axis][context(coarse)], (rest >> (bits - 1)) & 1u) ? 1u : 0u;
    return top << (bits - 1) | sides_[1].raw(rest & ((1u << (bits - 1)) - 1u), bits - 1);
  }

  void codeRotation(const CoarseScales& s, std::size_t i) {
    const int coarse = coarseRotationBits(q_.lattice, q_.precision[i], s);
    RotationCodes known{};
    for (std::size_t a = 0; a < 3; ++a) known[a] = codeCoarseRotation(a, coarse, i);
    const AxisBits bits = rotationBits(q_.lattice, q_.precision[i], s, known);
    for (std::size_t a = 0; a < 3; ++a) {
      const int below = Lattice::kMaxRotationBits - bits[a], rest = bits[a] - coarse;
      const auto written = std::uint32_t(q_.rotation[a][i] >> below) & ((1u << rest) - 1u);
      q_.rotation[a][i] = std::uint16_t(known[a] | sides_[2].raw(written, rest) << below);
    }
  }

  std::uint16_t codeCoarseRotation(std::size_t axis, int bits, std::size_t i) {
    constexpr int kTop = Lattice::kMaxRotationBits;
    std::uint32_t node = 1;
    for (int b = 1; b <= bits; ++b) {
      const bool bit = (q_.rotation[axis][i] >> (kTop - b)) & 1u;
      node = node << 1 | std::uint32_t(sides_[2].bit(rotation_[axis][node], bit));
    }
    return std::uint16_t((node - (1u << bits)) << (kTop - bits));
  }

  void codePlace(const AxisBits& bits, std::uint64_t key, std::size_t i) {
    for (std::size_t a = 0; a < 3; ++a) {
      const std::uint32_t place = q_.position[a][i] & ((1u << bits[a]) - 1u);
      q_.position[a][i] = gatherBits(key >> a) << bits[a] | sides_[0].raw(place, bits[a]);
    }
  }

  static constexpr std::size_t kWidths = 32;

  std::array<Side, kStreams>& sides_;
  QuantisedEllipsoids& q_;
  std::uint32_t lowBefore_ = 0;  ///< low scale of the previous ellipsoid, often a similar one
  std::array<codec::NumberModel, kContexts> low_, middle_, high_;
  std::array<std::array<codec::BitModel, kContexts>, 3> rest_;
  std::array<std::array<codec::BitModel, std::size_t{1} << kMaxCoarseRotationBits>, 3> rotation_;
  codec::BitModel sign_;
  std::array<codec::NumberModel, kSizes> magnitude_;
  std::array<codec::TreeModel<4>, kWidths> precision_;
};

}  // namespace

std::vector<Run> blockRuns(std::size_t count, std::span<const std::size_t> layerEnds) {
  std::vector<Run> runs;
  if (layerEnds.empty())
    for (std::size_t first = 0; first < count; first += kBlockEllipsoids)
      runs.push_back({first, std::min(kBlockEllipsoids, count - first)});
  std::size_t first = 0;
  for (const std::size_t end : layerEnds) {
    const std::size_t size = end - first;
    const std::size_t blocks = (size + kLayerBlockEllipsoids - 1) / kLayerBlockEllipsoids;
    const auto begin = [&](std::size_t k) { return first + size * k / blocks; };
    for (std::size_t k = 0; k < blocks; ++k) runs.push_back({begin(k), begin(k + 1) - begin(k)});
    first = end;
  }
  return runs;
}

void padForEllipsoids(ByteWriter& out, std::size_t count) {
  out.padTo(std::max(out.size(), (count + kMaxEllipsoidsPerByte - 1) / kMaxEllipsoidsPerByte));
}

void checkCount(const ByteReader& in, std::uint64_t stored, std::uint64_t count,
                std::uint64_t bytes) {
  if (stored != count || count / kMaxEllipsoidsPerByte > bytes)
    in.fail(counted(bytes, "byte") + " of content with " + counted(stored, "ellipsoid") + " for " +
            std::to_string(count));
}

BlockStreams encodeBlock(QuantisedEllipsoids& q, Run run) {
  std::array<codec::Writer, kStreams> writers;
  BlockCoder<codec::Writer>(writers, q).code(run);
  BlockStreams streams;
  for (std::size_t s = 0; s < kStreams; ++s) streams[s] = writers[s].coder.finish();
  return streams;
}

std::vector<BlockStreams> encodeBlocks(QuantisedEllipsoids q) {
  const std::vector<Run> runs = blockRuns(q);
  std::vector<BlockStreams> blocks(runs.size());
  // The coder writes each value that it reads back to `q`, and each block only to its own run.
  parallelFor(std::size_t{0}, runs.size(),
              [&](std::size_t b) { blocks[b] = encodeBlock(q, runs[b]); });
  return blocks;
}

void decodeBlock(const BlockBytes& streams, Run run, QuantisedEllipsoids& q) {
  std::array<codec::Reader, kStreams> readers{codec::Reader{codec::RangeDecoder(streams[0])},
                                              codec::Reader{codec::RangeDecoder(streams[1])},
                                              codec::Reader{codec::RangeDecoder(streams[2])},
                                              codec::Reader{codec::RangeDecoder(streams[3])}};
  BlockCoder<codec::Reader>(readers, q).code(run);
}

}  // namespace format

// ---- Bytes of layers and streams

namespace {

std::size_t layersOf(const QuantisedEllipsoids& q) {
  return q.layerEnds.empty() ? std::min<std::size_t>(q.size(), 1) : q.layerEnds.size();
}

std::uint64_t bytesOf(const format::BlockStreams& block) {
  return std::accumulate(block.begin(), block.end(), std::uint64_t{0},
                         [](std::uint64_t sum, const auto& s) { return sum + s.size(); });
}

void addLayers(const QuantisedEllipsoids& q, std::vector<LayerSize>& sizes) {
  const auto runs = format::blockRuns(q);
  const auto blocks = format::encodeBlocks(q);
  std::size_t layer = 0;
  for (std::size_t b = 0; b < runs.size(); ++b) {
    if (!q.layerEnds.empty() && runs[b].first == q.layerEnds[layer]) ++layer;
    sizes[layer].ellipsoids += runs[b].count;
    sizes[layer].bytes += bytesOf(blocks[b]);
  }
}

}  // namespace

std::size_t layerCount(const StoredGrid& grid) {
  if (grid.quantised.empty()) return std::min<std::size_t>(grid.field.ellipsoidCount(), 1);
  std::size_t layers = 0;
  for (const auto& chunk : grid.quantised) layers = std::max(layers, layersOf(chunk));
  return layers;
}

std::vector<LayerSize> layerSizes(const StoredGrid& grid) {
  std::vector<LayerSize> sizes(grid.quantised.empty() ? 0 : layerCount(grid));
  for (const auto& chunk : grid.quantised) addLayers(chunk, sizes);
  return sizes;
}

StreamBytes streamBytes(const StoredGrid& grid) {
  StreamBytes bytes;
  for (const auto& chunk : grid.quantised) {
    for (const auto& block : format::encodeBlocks(chunk)) {
      bytes.positions += block[0].size();
      bytes.scales += block[1].size();
      bytes.rotations += block[2].size();
      bytes.intensities += block[3].size();
    }
  }
  return bytes;
}

}  // namespace esvr

namespace esvr::format {

// ---- Exact ellipsoids

namespace {

constexpr std::array<float, 4> kIdentity{1.0f, 0.0f, 0.0f, 0.0f};

/// Compares bits, so that negative zero is stored as such and not taken for zero.
bool sameBits(float a, float b) {
  return std::bit_cast<std::uint32_t>(a) == std::bit_cast<std::uint32_t>(b);
}

}  // namespace

std::vector<std::byte> putPlanes(std::span<const Plane> planes) {
  ByteWriter out;
  for (const auto& plane : planes) out.putAll(plane);
  return out.take();
}

void getPlanes(std::span<const std::byte> content, std::uint64_t count, std::span<Plane> planes,
               const std::string& where) {
  const std::uint64_t perEllipsoid = planes.size() * sizeof(float);
  if (content.size() % perEllipsoid != 0 || content.size() / perEllipsoid != count)
    throw BadInput(where + ": " + counted(content.size(), "byte") + " of content for " +
                   counted(count, "ellipsoid"));
  for (auto& plane : planes) {
    plane.resize(count);
    if (count != 0) std::memcpy(plane.data(), content.data(), count * sizeof(float));
    content = content.subspan(count * sizeof(float));
  }
}

bool allIdentity(const std::array<Plane, 4>& rotation) {
  for (std::size_t c = 0; c < rotation.size(); ++c) {
    const auto differs = [c](float q) { return !sameBits(q, kIdentity[c]); };
    if (std::any_of(rotation[c].begin(), rotation[c].end(), differs)) return false;
  }
  return true;
}

void setIdentity(std::array<Plane, 4>& rotation, std::size_t count) {
  for (std::size_t c = 0; c < rotation.size(); ++c) rotation[c].assign(count, kIdentity[c]);
}

// ---- Quantised ellipsoids

namespace {

constexpr std::uint64_t kTableEntryBytes = kStreams * sizeof(std::uint32_t);

std::vector<std::array<std::uint32_t, kStreams>> getBlockTable(ByteReader& in, std::size_t blocks) {
  if (in.left() / kTableEntryBytes < blocks) in.fail("ends within the table of blocks");
  std::vector<std::array<std::uint32_t, kStreams>> table(blocks);
  for (auto& sizes : table)
    for (auto& size : sizes) size = in.get<std::uint32_t>();
  return table;
}

void decodeBlocks(ByteReader& in, QuantisedEllipsoids& q) {
  const auto runs = blockRuns(q);
  const auto table = getBlockTable(in, runs.size());
  for (std::size_t b = 0; b < runs.size(); ++b) {
    BlockBytes streams;
    for (std::size_t s = 0; s < kStreams; ++s) streams[s] = in.getBytes(table[b][s]);
    try {
      decodeBlock(streams, runs[b], q);
    } catch (const BadInput& error) {
      in.fail("block " + std::to_string(b) + ": " + error.what());
    }
  }
}

}  // namespace

std::vector<std::byte> putEllipsoids(const QuantisedEllipsoids& q) {
  ByteWriter out;
  out.put(std::uint64_t(q.size()));
  codeLattice(out, q.lattice);
  const auto blocks = encodeBlocks(q);
  for (const auto& block : blocks)
    for (const auto& stream : block) out.put(std::uint32_t(stream.size()));
  for (const auto& block : blocks)
    for (const auto& stream : block) out.putAll(stream);
  padForEllipsoids(out, q.size());
  return out.take();
}

QuantisedEllipsoids getEllipsoids(std::span<const std::byte> content, std::uint64_t count,
                                  const std::string& where) {
  ByteReader in(content, where);
  const auto stored = in.get<std::uint64_t>();
  checkCount(in, stored, count, content.size());
  QuantisedEllipsoids q;
  codeLattice(in, q.lattice);
  q.resize(count);
  decodeBlocks(in, q);
  in.finishZeros();
  return q;
}

// ---- Importance layers

namespace {

constexpr std::size_t kMaxLayers = 255;
constexpr std::uint64_t kBoxBytes = 6;
constexpr std::uint64_t kBlockEntryBytes =
    kBoxBytes + kStreams * sizeof(std::uint32_t) + sizeof(std::uint64_t);
constexpr std::uint64_t kChecksumBytes = sizeof(std::uint64_t);

constexpr std::int64_t kPartsOfBox = 256;  // divisions of a chunk's box along an axis

/// Writes a block's box in 256ths of its chunk's box, rounded outwards.
void putBox(ByteWriter& out, const Box& box, const Box& chunk) {
  for (const auto axis : kAxes) {
    const std::int64_t low = chunk.min.*axis, side = std::int64_t(chunk.max.*axis) - low + 1;
    out.put(std::uint8_t((box.min.*axis - low) * kPartsOfBox / side));
    out.put(std::uint8_t((box.max.*axis - low) * kPartsOfBox / side));
  }
}

Box getBox(ByteReader& in, const Box& chunk) {
  Box box;
  for (const auto axis : kAxes) {
    const std::int64_t low = chunk.min.*axis, side = std::int64_t(chunk.max.*axis) - low + 1;
    const std::int64_t first = in.get<std::uint8_t>(), last = in.get<std::uint8_t>();
    if (first > last) in.fail("the box of a block is empty");
    box.min.*axis = std::int32_t(low + first * side / kPartsOfBox);
    box.max.*axis = std::int32_t(low + ((last + 1) * side + kPartsOfBox - 1) / kPartsOfBox - 1);
  }
  return box;
}

std::vector<std::byte> joined(const BlockStreams& streams) {
  std::vector<std::byte> bytes;
  for (const auto& stream : streams) bytes.insert(bytes.end(), stream.begin(), stream.end());
  return bytes;
}

/// The directory without its own size before it and its checksum behind it.
std::vector<std::byte> putDirectory(const QuantisedEllipsoids& q, const Box& chunk,
                                    std::span<const Box> boxes,
                                    std::span<const BlockStreams> blocks) {
  ByteWriter out;
  out.put(std::uint64_t(q.size()));
  codeLattice(out, q.lattice);
  out.put(std::uint8_t(q.layerEnds.size()));
  for (const std::size_t end : q.layerEnds) out.put(std::uint64_t(end));
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    putBox(out, boxes[b], chunk);
    for (const auto& stream : blocks[b]) out.put(std::uint32_t(stream.size()));
    out.put(checksum(joined(blocks[b])));
  }
  return out.take();
}

std::vector<std::size_t> getLayerEnds(ByteReader& in, std::uint64_t count) {
  std::vector<std::size_t> ends(in.get<std::uint8_t>());
  std::size_t last = 0;
  for (auto& end : ends) {
    end = in.get<std::uint64_t>();
    if (end <= last || end > count) in.fail("a layer is empty or beyond the chunk");
    last = end;
  }
  if (ends.size() < 2 || last != count) in.fail("the layers are not those of the chunk");
  return ends;
}

std::size_t layerOf(const std::vector<std::size_t>& ends, std::size_t i) {
  return std::size_t(std::upper_bound(ends.begin(), ends.end(), i) - ends.begin());
}

/// Reads the entries of the directory. \param offset  position of the first block in the section
std::vector<BlockEntry> getEntries(ByteReader& in, const BlockDirectory& directory,
                                   const ChunkRecord& chunk, std::uint64_t offset) {
  const auto runs = blockRuns(chunk.count, directory.layerEnds);
  if (in.left() != runs.size() * kBlockEntryBytes) in.fail("not a directory of these blocks");
  std::vector<BlockEntry> entries;
  for (const Run run : runs) {
    BlockEntry entry{run, layerOf(directory.layerEnds, run.first), getBox(in, chunk.box)};
    for (auto& size : entry.bytes) size = in.get<std::uint32_t>();
    entry.checksum = in.get<std::uint64_t>();
    entry.offset = offset;
    offset += entry.size();
    entries.push_back(entry);
  }
  return entries;
}

/// Reads the directory and checks its checksum. \return the bytes between its size and its checksum
std::vector<std::byte> readDirectory(const ByteSource& section) {
  constexpr std::uint64_t kSizeBytes = sizeof(std::uint32_t);
  auto bytes = section.read(0, kSizeBytes);
  const std::uint64_t size = ByteReader(bytes, section.name()).get<std::uint32_t>();
  if (size > section.size() || size < kSizeBytes + kChecksumBytes)
    throw BadInput(section.name() + ": a directory of " + std::to_string(size) + " bytes in " +
                   std::to_string(section.size()));
  const auto rest = section.read(kSizeBytes, size - kSizeBytes);
  bytes.insert(bytes.end(), rest.begin(), rest.end());
  const auto covered = std::span(bytes).first(size - kChecksumBytes);
  const auto stored = std::span(bytes).last(kChecksumBytes);
  if (ByteReader(stored, section.name()).get<std::uint64_t>() != checksum(covered))
    throw BadInput(section.name() + ": checksum of the directory does not match");
  return {covered.begin() + kSizeBytes, covered.end()};
}

void checkInside(const ByteSource& section, const BlockDirectory& directory) {
  const BlockEntry& last = directory.blocks.back();
  if (last.offset + last.size() > section.size())
    throw BadInput(section.name() + ": the blocks do not lie in the section");
}

std::vector<std::byte> readBlock(const ByteSource& section, const BlockEntry& entry) {
  auto bytes = section.read(entry.offset, entry.size());
  if (checksum(bytes) != entry.checksum)
    throw BadInput(section.name() + ": checksum of a block does not match");
  return bytes;
}

void decodeInto(std::span<const std::byte> bytes, const BlockEntry& entry, Run run,
                QuantisedEllipsoids& q) {
  BlockBytes streams;
  for (std::size_t s = 0; s < kStreams; ++s) {
    streams[s] = bytes.first(entry.bytes[s]);
    bytes = bytes.subspan(entry.bytes[s]);
  }
  decodeBlock(streams, run, q);
}

/// The ends of the layers of the chosen blocks; empty if they are of one layer.
std::vector<std::size_t> endsOf(const BlockDirectory& directory,
                                std::span<const std::size_t> chosen) {
  std::vector<std::size_t> ends;
  std::size_t at = 0;
  for (std::size_t k = 0; k < chosen.size(); ++k) {
    const BlockEntry& entry = directory.blocks[chosen[k]];
    at += entry.run.count;
    const bool last = k + 1 == chosen.size();
    if (last || directory.blocks[chosen[k + 1]].layer != entry.layer) ends.push_back(at);
  }
  if (ends.size() < 2) ends.clear();
  return ends;
}

}  // namespace

std::uint64_t BlockEntry::size() const {
  return std::accumulate(bytes.begin(), bytes.end(), std::uint64_t{0});
}

std::vector<std::byte> putLayered(const QuantisedEllipsoids& q, const Box& chunk,
                                  std::span<const Box> boxes) {
  if (q.layerEnds.size() > kMaxLayers) throw RuntimeFailure("too many importance layers");
  const auto blocks = encodeBlocks(q);
  const auto directory = putDirectory(q, chunk, boxes, blocks);
  ByteWriter out;
  out.put(std::uint32_t(sizeof(std::uint32_t) + directory.size() + kChecksumBytes));
  out.putAll(directory);
  out.put(checksum(out.bytes()));
  for (const auto& block : blocks) out.putAll(joined(block));
  padForEllipsoids(out, q.size());
  return out.take();
}

std::uint64_t storedBytes(const QuantisedEllipsoids& q) {
  if (q.layerEnds.empty()) return putEllipsoids(q).size();
  const Box any{{}, {}};  // the number of bytes does not depend on the boxes
  return putLayered(q, any, std::vector<Box>(blockRuns(q).size(), any)).size();
}

BlockDirectory getDirectory(const ByteSource& section, const ChunkRecord& chunk) {
  const auto bytes = readDirectory(section);
  ByteReader in(bytes, section.name());
  checkCount(in, in.get<std::uint64_t>(), chunk.count, section.size());
  if (chunk.box.empty()) in.fail("the chunk's box is empty");
  BlockDirectory directory;
  codeLattice(in, directory.lattice);
  directory.layerEnds = getLayerEnds(in, chunk.count);
  directory.blocks =
      getEntries(in, directory, chunk, sizeof(std::uint32_t) + bytes.size() + kChecksumBytes);
  checkInside(section, directory);
  return directory;
}

QuantisedEllipsoids getBlocks(const ByteSource& section, const BlockDirectory& directory,
                              std::span<const std::size_t> chosen) {
  QuantisedEllipsoids q;
  q.lattice = directory.lattice;
  q.layerEnds = endsOf(directory, chosen);
  for (const std::size_t b : chosen) {
    const BlockEntry& entry = directory.blocks[b];
    const Run run{q.size(), entry.run.count};
    const auto bytes = readBlock(section, entry);
    q.resize(run.first + run.count);
    try {
      decodeInto(bytes, entry, run, q);
    } catch (const BadInput& error) {
      throw BadInput(section.name() + ": block " + std::to_string(b) + ": " + error.what());
    }
  }
  return q;
}

void checkEnd(const ByteSource& section, const BlockDirectory& directory) {
  const BlockEntry& last = directory.blocks.back();
  const std::uint64_t end = last.offset + last.size();
  const auto rest = section.read(end, section.size() - end);
  ByteReader(rest, section.name()).finishZeros();
}

}  // namespace esvr::format
