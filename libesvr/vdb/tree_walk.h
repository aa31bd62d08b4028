#pragma once
/// A walk over a grid's tree in a .vdb file (tree_survey.h has the layout) that checks all sizes
/// and tells a visitor what the tree holds. The tree itself is never in memory.

#include <blosc.h>

#include "vdb/versions.h"

#include <openvdb/io/Compression.h>

#include <array>
#include <bit>
#include <set>
#include <string>

#include "esvr/error.h"
#include "esvr/sparse_volume.h"
#include "vdb/input_file.h"
#include "vdb/tree_survey.h"

namespace esvr::vdb {

/// One bit for each cell of a node, as OpenVDB stores it, with z fastest.
template <int kLog2>
struct NodeMask {
  static constexpr std::size_t kCells = std::size_t{1} << (3 * kLog2);
  std::array<std::uint64_t, kCells / 64> words;

  [[nodiscard]] bool test(std::size_t n) const { return (words[n >> 6] >> (n & 63)) & 1u; }
  [[nodiscard]] std::uint64_t count() const {
    std::uint64_t n = 0;
    for (auto word : words) n += std::uint64_t(std::popcount(word));
    return n;
  }
  [[nodiscard]] bool overlaps(const NodeMask& other) const {
    for (std::size_t i = 0; i < words.size(); ++i)
      if (words[i] & other.words[i]) return true;
    return false;
  }
  template <class Visit>
  void forEachSet(Visit&& visit) const {
    for (std::size_t i = 0; i < words.size(); ++i)
      for (std::uint64_t word = words[i]; word; word &= word - 1)
        visit(i * 64 + std::size_t(std::countr_zero(word)));
  }
};

inline constexpr int kLowerLog2 = 4, kUpperLog2 = 5;
inline constexpr std::int32_t kLowerExtent = kBrickSide << kLowerLog2;    ///< 128 voxels
inline constexpr std::int32_t kUpperExtent = kLowerExtent << kUpperLog2;  ///< 4096

using LeafMask = NodeMask<kBrickLog2>;
using LowerMask = NodeMask<kLowerLog2>;
using UpperMask = NodeMask<kUpperLog2>;

/// The corner of the n-th cell of a node.
template <int kLog2>
Coord cellCorner(Coord corner, std::size_t n, std::int32_t cellExtent) {
  constexpr std::size_t kMask = (std::size_t{1} << kLog2) - 1;
  const Coord cell{std::int32_t(n >> (2 * kLog2)), std::int32_t((n >> kLog2) & kMask),
                   std::int32_t(n & kMask)};
  return corner + cell * cellExtent;
}

/// The values of a node's tiles in the file.
struct TileValues {
  std::uint64_t at = 0;  ///< position of the node's block of values
  Coord corner;          ///< corner of the node
};

/// Walks over the topology of a tree, which comes first in the file, and over the values of its
/// leaves. A Visitor has these functions:
///   leaf(corner, mask)                      for each leaf, in the file's order
///   rootTile(corner, at)                    for each active tile of the root; its value is at `at`
///   tiles<kLog2>(mask, TileValues, extent)  for each node with active tiles; it may move the file
template <class Visitor>
class TreeWalk {
 public:
  TreeWalk(InputFile& file, const ValueLayout& layout, Visitor& visitor)
      : file_(file), layout_(layout), visitor_(visitor) {}

  /// \throws BadInput  the topology is truncated or damaged
  void topology() {
    if (file_.read<std::int32_t>() != 1) damaged("other than one value a voxel");
    file_.skip(layout_.valueBytes);  // background
    const auto tiles = file_.read<std::uint32_t>();
    const auto children = file_.read<std::uint32_t>();
    for (std::uint32_t i = 0; i < tiles; ++i) rootTile();
    for (std::uint32_t i = 0; i < children; ++i) upperNode(rootKey());
  }

  /// Checks the values of a leaf. \throws BadInput  they are truncated or damaged
  void leafValues() {
    const auto mask = file_.read<LeafMask>();
    if (layout_.leavesOfBits) return file_.skip(sizeof(Coord) + sizeof(LeafMask));
    valueBlock(mask);
  }

 private:
  [[noreturn]] void damaged(const std::string& what) const {
    throw BadInput("is damaged at byte " + std::to_string(file_.position()) + ": " + what);
  }

  Coord rootKey() {
    const auto key = file_.read<Coord>();
    if (key.x % kUpperExtent || key.y % kUpperExtent || key.z % kUpperExtent)
      damaged("a node at the impossible place " + toString(key));
    if (!rootKeys_.insert(key).second) damaged("two nodes at " + toString(key));
    return key;
  }

  void rootTile() {
    const Coord key = rootKey();
    const std::uint64_t at = file_.position();
    file_.skip(layout_.valueBytes);
    const auto active = file_.read<std::uint8_t>();
    if (active > 1) damaged("a flag that is neither 0 nor 1");
    if (active) visitor_.rootTile(key, at);
  }

  void upperNode(Coord corner) {
    const auto children = nodeHead<UpperMask, kUpperLog2>(corner, kLowerExtent);
    children.forEachSet(
        [&](std::size_t n) { lowerNode(cellCorner<kUpperLog2>(corner, n, kLowerExtent)); });
  }

  void lowerNode(Coord corner) {
    const auto children = nodeHead<LowerMask, kLowerLog2>(corner, kBrickSide);
    children.forEachSet(
        [&](std::size_t n) { leaf(cellCorner<kLowerLog2>(corner, n, kBrickSide)); });
  }

  void leaf(Coord corner) { visitor_.leaf(corner, file_.read<LeafMask>()); }

  /// Reads an inner node up to its child nodes. \return the cells that have one
  template <class Mask, int kLog2>
  Mask nodeHead(Coord corner, std::int32_t cellExtent) {
    const auto children = file_.read<Mask>();
    const auto active = file_.read<Mask>();
    if (children.overlaps(active)) damaged("a cell that is both tile and node");
    const std::uint64_t at = file_.position();
    valueBlock(active);
    const std::uint64_t end = file_.position();
    if (active.count() > 0) visitor_.template tiles<kLog2>(active, {at, corner}, cellExtent);
    if (file_.position() != end) file_.seek(end);
    return children;
  }

  /// Skips the block of a node's values.
  template <class Mask>
  void valueBlock(const Mask& active) {
    const auto inactive = file_.read<std::int8_t>();
    if (inactive < openvdb::io::NO_MASK_OR_INACTIVE_VALS ||
        inactive > openvdb::io::NO_MASK_AND_ALL_VALS)
      damaged("unknown packing of a node");
    file_.skip(inactiveValues(inactive) * layout_.valueBytes);
    if (hasSelectionMask(inactive)) file_.skip(sizeof(Mask));
    const bool activeOnly = (layout_.compression & openvdb::io::COMPRESS_ACTIVE_MASK) &&
                            inactive != openvdb::io::NO_MASK_AND_ALL_VALS;
    valueArray(activeOnly ? active.count() : Mask::kCells);
  }

  static std::uint64_t inactiveValues(std::int8_t inactive) {
    if (inactive == openvdb::io::MASK_AND_TWO_INACTIVE_VALS) return 2;
    return inactive == openvdb::io::NO_MASK_AND_ONE_INACTIVE_VAL ||
           inactive == openvdb::io::MASK_AND_ONE_INACTIVE_VAL;
  }
  static bool hasSelectionMask(std::int8_t inactive) {
    return inactive == openvdb::io::MASK_AND_NO_INACTIVE_VALS ||
           inactive == openvdb::io::MASK_AND_ONE_INACTIVE_VAL ||
           inactive == openvdb::io::MASK_AND_TWO_INACTIVE_VALS;
  }

  void valueArray(std::uint64_t count) {
    if (layout_.savedAsHalf && count == 0) return;  // OpenVDB stores nothing then, not even a size
    const std::uint64_t bytes =
        count * (layout_.savedAsHalf ? layout_.halfBytes : layout_.valueBytes);
    if (layout_.compression & (openvdb::io::COMPRESS_BLOSC | openvdb::io::COMPRESS_ZIP))
      chunk(bytes);
    else
      file_.skip(bytes);
  }

  /// Skips a size, which is negative if the bytes are not compressed, and the bytes.
  void chunk(std::uint64_t rawBytes) {
    const auto size = file_.read<std::int64_t>();
    if (size <= 0) {
      if (0 - std::uint64_t(size) != rawBytes) damaged("a chunk of a wrong size");
      return file_.skip(rawBytes);
    }
    const bool blosc = layout_.compression & openvdb::io::COMPRESS_BLOSC;
    file_.skip(std::uint64_t(size) - (blosc ? bloscHeader(std::uint64_t(size), rawBytes) : 0));
  }

  /// \return the length of the header
  std::uint64_t bloscHeader(std::uint64_t storedBytes, std::uint64_t rawBytes) {
    file_.need(storedBytes);
    if (storedBytes < BLOSC_MIN_HEADER_LENGTH) damaged("a Blosc chunk without a header");
    const auto header = file_.read<std::array<std::byte, BLOSC_MIN_HEADER_LENGTH>>();
    std::size_t announced = 0;
    if (blosc_cbuffer_validate(header.data(), storedBytes, &announced) != 0 ||
        announced != rawBytes)
      damaged("a Blosc chunk whose header contradicts its size");
    return BLOSC_MIN_HEADER_LENGTH;
  }

  InputFile& file_;
  ValueLayout layout_;
  Visitor& visitor_;
  std::set<Coord> rootKeys_;
};

}  // namespace esvr::vdb
