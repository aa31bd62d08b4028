#pragma once
/// A walk over a grid's tree in a .vdb file that checks all sizes and tells a visitor what the tree
/// holds. The tree itself is never in memory. OpenVDB does not check sizes (a negative chunk size makes
/// it write beyond its buffers, a damaged Blosc header read beyond its input), so it gets a tree only
/// after a walk has checked all of them. The survey of a tree is such a walk.
///
/// The layout of a tree of 32^3, 16^3 and 8^3 nodes, in OpenVDB's format versions from 222 on:
///   1 (a buffer count), background, tile count, child count, tiles (coordinates, value, active),
///   children (coordinates, upper node);
///   a node: child mask, value mask, values (block), child nodes; a leaf: value mask;
///   then for each leaf: value mask, values (block).
///   A block: a byte that says how inactive values are stored, up to two of them, up to one mask,
///   the values, compressed as the grid's flags say.

#include "vdb/open_vdb.h"

#include <blosc.h>
#include <openvdb/io/Compression.h>

#include <array>
#include <bit>
#include <cstdint>
#include <optional>
#include <set>
#include <string>

#include "core/parallel.h"
#include "esvr/error.h"
#include "esvr/volume.h"
#include "vdb/files.h"

namespace esvr::vdb {

/// The way in which a grid's values are stored in the file.
struct ValueLayout {
  std::uint64_t valueBytes = 4;   ///< size in memory: 4 for float, 8 for double, 12 for vec3s, ...
  std::uint64_t halfBytes = 2;    ///< size of a value as half: 2 for float, 6 for vec3s, ...
  bool savedAsHalf = false;       ///< in blocks, not in the background and the root's tiles
  std::uint32_t compression = 0;  ///< OpenVDB's flags
  /// How the values of a leaf are stored: as a mask and a block, in a number of bytes that is the
  /// same for all leaves (bool, mask), or in a way of their own that is not known here (points).
  enum class Leaves { kBlocks, kFixed, kOther } leaves = Leaves::kBlocks;
  std::uint64_t leafBytes = 0;  ///< of kFixed
};

/// What decides how the values of a tree are stored.
struct StoredTree {
  std::string treeType;  ///< "Tree_float_5_4_3"
  bool savedAsHalf = false;
  std::uint32_t compression = 0;  ///< OpenVDB's flags
};

/// The layout of a tree; nothing if its nodes have other sizes than OpenVDB's usual ones, or if its
/// type is unknown or has no fixed size, such as a string.
[[nodiscard]] std::optional<ValueLayout> layoutOf(const StoredTree& tree);

struct TreeSurvey {
  std::uint64_t leaves = 0;
  std::uint64_t activeVoxels = 0;  ///< including those of tiles
  std::uint64_t tileBricks = 0;    ///< number of 8^3 bricks that the active tiles cover
  Box activeBox;
};

/// Surveys the tree at the position of the file. \throws BadInput  it is truncated or damaged
TreeSurvey surveyTree(InputFile& file, const ValueLayout& layout);

/// Positions in a file; 0 if they are not known.
struct TreeExtent {
  std::uint64_t valuesAt = 0;  ///< of the values of the first leaf
  std::uint64_t end = 0;       ///< behind the tree
};

/// Finds the end of the tree at the position of the file. \throws BadInput  as for surveyTree
[[nodiscard]] TreeExtent extentOfTree(InputFile& file, const ValueLayout& layout);

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

/// The cells of an inner node in the file. A cell has a child node or a tile.
template <class Mask>
struct NodeCells {
  Mask children, active;  ///< the active cells are tiles
  std::uint64_t at = 0;   ///< position of the node's block of values
  /// True if all inactive tiles have the background.
  bool onlyBackground = false;
  Coord corner;  ///< corner of the node
};

/// Walks over the topology of a tree, which comes first in the file, and over the values of its
/// leaves. A Visitor has these functions:
///   leaf(corner, mask)                      for each leaf, in the file's order
///   rootTile(corner, at, isActive)          for each tile of the root; its value is at `at`
///   tiles<kLog2>(NodeCells, extent)         for each inner node; it may move the file
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
    if (layout_.leaves == ValueLayout::Leaves::kFixed) return file_.skip(layout_.leafBytes);
    const auto mask = file_.read<LeafMask>();
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
    visitor_.rootTile(key, at, active == 1);
  }

  void upperNode(Coord corner) {
    const auto children = nodeHead<UpperMask, kUpperLog2>(corner, kLowerExtent);
    children.forEachSet(
        [&](std::size_t n) { lowerNode(cellCorner<kUpperLog2>(corner, n, kLowerExtent)); });
  }

  void lowerNode(Coord corner) {
    throwIfCancelled();
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
    const auto packing = valueBlock(active);
    const std::uint64_t end = file_.position();
    const bool onlyBackground = packing == openvdb::io::NO_MASK_OR_INACTIVE_VALS;
    visitor_.template tiles<kLog2>(NodeCells<Mask>{children, active, at, onlyBackground, corner},
                                   cellExtent);
    if (file_.position() != end) file_.seek(end);
    return children;
  }

  /// Skips the block of a node's values. \return how its inactive values are stored
  template <class Mask>
  std::int8_t valueBlock(const Mask& active) {
    const auto inactive = file_.read<std::int8_t>();
    if (inactive < openvdb::io::NO_MASK_OR_INACTIVE_VALS ||
        inactive > openvdb::io::NO_MASK_AND_ALL_VALS)
      damaged("unknown packing of a node");
    file_.skip(inactiveValues(inactive) * layout_.valueBytes);
    if (hasSelectionMask(inactive)) file_.skip(sizeof(Mask));
    const bool activeOnly = (layout_.compression & openvdb::io::COMPRESS_ACTIVE_MASK) &&
                            inactive != openvdb::io::NO_MASK_AND_ALL_VALS;
    valueArray(activeOnly ? active.count() : Mask::kCells);
    return inactive;
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
