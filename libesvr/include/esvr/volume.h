#pragma once
/// A sparse volume of voxels, its coordinates and its memory. SparseVolume is the library's only container
/// for the voxels that it computes with; vdb_io.h converts OpenVDB and NanoVDB grids to it and back.

#include <algorithm>
#include <array>
#include <bit>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace esvr {

// Integer coordinates and boxes, in voxels of a grid's index space.

/// The integer coordinates of a voxel. They are ordered lexicographically by x, y, z.
struct Coord {
  std::int32_t x = 0, y = 0, z = 0;

  friend constexpr auto operator<=>(const Coord&, const Coord&) = default;
  friend constexpr Coord operator+(Coord a, Coord b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
  friend constexpr Coord operator-(Coord a, Coord b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
  friend constexpr Coord operator*(Coord a, std::int32_t s) { return {a.x * s, a.y * s, a.z * s}; }
};

/// Componentwise minimum and maximum.
constexpr Coord minCoord(Coord a, Coord b) {
  return {std::min(a.x, b.x), std::min(a.y, b.y), std::min(a.z, b.z)};
}
constexpr Coord maxCoord(Coord a, Coord b) {
  return {std::max(a.x, b.x), std::max(a.y, b.y), std::max(a.z, b.z)};
}

/// The text "(x, y, z)", for messages.
inline std::string toString(Coord c) {
  return "(" + std::to_string(c.x) + ", " + std::to_string(c.y) + ", " + std::to_string(c.z) + ")";
}

/// A box of voxels that includes both corners. The default is an empty box.
struct Box {
  static constexpr std::int32_t kMax = std::numeric_limits<std::int32_t>::max();
  static constexpr std::int32_t kMin = std::numeric_limits<std::int32_t>::min();

  Coord min{kMax, kMax, kMax};
  Coord max{kMin, kMin, kMin};

  /// The box of all possible voxels.
  [[nodiscard]] static constexpr Box whole() { return {{kMin, kMin, kMin}, {kMax, kMax, kMax}}; }

  friend constexpr bool operator==(const Box&, const Box&) = default;
  [[nodiscard]] constexpr bool empty() const {
    return min.x > max.x || min.y > max.y || min.z > max.z;
  }
  [[nodiscard]] constexpr bool contains(Coord c) const {
    return c.x >= min.x && c.x <= max.x && c.y >= min.y && c.y <= max.y && c.z >= min.z &&
           c.z <= max.z;
  }
  constexpr void expand(Coord c) {
    min = minCoord(min, c);
    max = maxCoord(max, c);
  }
  constexpr void expand(const Box& b) {
    min = minCoord(min, b.min);
    max = maxCoord(max, b.max);
  }
  /// Number of voxels. It is a double because it may exceed 64 bits.
  [[nodiscard]] constexpr double volume() const {
    if (empty()) return 0.0;
    return (double(max.x) - min.x + 1) * (double(max.y) - min.y + 1) * (double(max.z) - min.z + 1);
  }
};

/// The intersection of two boxes.
[[nodiscard]] constexpr Box common(const Box& a, const Box& b) {
  return {maxCoord(a.min, b.min), minCoord(a.max, b.max)};
}

// Memory for arrays of voxels. Usually it is the heap. Arrays that are larger than a limit are in
// files that the system maps into memory, so that a volume may be larger than the memory.

class VoxelFiles;

/// A choice between the heap and files, by size. Copies share their files, and any thread may use
/// them. The files have no names; the system removes them when the last array ends, or the process.
class VoxelMemory {
 public:
  VoxelMemory() = default;  ///< always the heap

  struct Files {
    std::filesystem::path folder;    ///< on a disk; a folder in memory would save none
    std::uint64_t maxHeapBytes = 0;  ///< larger arrays are in files
    /// Limit on the part of all files that is in the memory of the process. A thread looks several
    /// times a second and gives back what exceeds the limit, so that it may be exceeded in between.
    std::uint64_t maxResidentBytes = 0;
  };
  explicit VoxelMemory(const Files& files);

  /// \return whether an array of this size is in a file
  [[nodiscard]] bool isInFile(std::uint64_t bytes) const;

  /// The same files for arrays of any size; the heap, if there are no files.
  [[nodiscard]] VoxelMemory forAllSizes() const;

  /// Checks that the disk of the files has this many bytes free. The heap is not checked.
  /// \param what  subject of the message, for example "grid 'density'"
  /// \throws MemoryExceeded  it has fewer; the text names the folder and gives both numbers
  void requireRoom(double bytes, const std::string& what) const;

  /// \throws RuntimeFailure  the folder cannot be written, or its disk is full
  /// \throws std::bad_alloc  the heap is full
  [[nodiscard]] void* allocate(std::size_t bytes) const;
  void deallocate(void* array, std::size_t bytes) const noexcept;

  friend bool operator==(const VoxelMemory&, const VoxelMemory&) = default;

 private:
  std::shared_ptr<VoxelFiles> files_;  ///< null: always the heap
  bool isForAllSizes_ = false;         ///< arrays below maxHeapBytes are in files, too
};

/// The allocator of arrays of voxels. A copy of an array is in the same kind of memory.
template <class T>
class VoxelAllocator {
 public:
  using value_type = T;
  using propagate_on_container_copy_assignment = std::true_type;
  using propagate_on_container_move_assignment = std::true_type;
  using propagate_on_container_swap = std::true_type;

  VoxelAllocator() = default;
  VoxelAllocator(VoxelMemory memory) : memory_(std::move(memory)) {}  // NOLINT: converts
  template <class U>
  VoxelAllocator(const VoxelAllocator<U>& other) : memory_(other.memory()) {}

  [[nodiscard]] const VoxelMemory& memory() const { return memory_; }
  [[nodiscard]] T* allocate(std::size_t count) {
    return static_cast<T*>(memory_.allocate(count * sizeof(T)));
  }
  void deallocate(T* array, std::size_t count) noexcept {
    memory_.deallocate(array, count * sizeof(T));
  }
  friend bool operator==(const VoxelAllocator&, const VoxelAllocator&) = default;

 private:
  VoxelMemory memory_;
};

template <class T>
using VoxelArray = std::vector<T, VoxelAllocator<T>>;

// A sparse scalar volume: bricks of 8^3 voxels at integer coordinates, and one background value
// elsewhere. It is the library's only container for voxels; vdb_io.h converts OpenVDB and NanoVDB
// grids to it and back. Its size depends on the number of bricks and not on the bounding box.

inline constexpr int kBrickLog2 = 3;
inline constexpr int kBrickSide = 1 << kBrickLog2;                         ///< voxels along an edge
inline constexpr int kBrickVoxels = kBrickSide * kBrickSide * kBrickSide;  ///< 512

/// Offset of a voxel in its brick: x * 64 + y * 8 + z, as in an OpenVDB leaf.
/// \param local  coordinates in the brick, each 0 to 7
constexpr int voxelOffset(Coord local) { return (local.x << 6) | (local.y << 3) | local.z; }
constexpr Coord voxelLocal(int offset) { return {offset >> 6, (offset >> 3) & 7, offset & 7}; }

/// The brick that contains a voxel (by floor division, also for negative coordinates), and the
/// voxel's coordinates in the brick.
constexpr Coord brickOf(Coord v) {
  return {v.x >> kBrickLog2, v.y >> kBrickLog2, v.z >> kBrickLog2};
}
constexpr Coord localOf(Coord v) {
  return {v.x & (kBrickSide - 1), v.y & (kBrickSide - 1), v.z & (kBrickSide - 1)};
}

/// A bit for each voxel of a brick; word x holds the 64 voxels of slice x, at bit y * 8 + z.
struct BrickMask {
  std::array<std::uint64_t, kBrickSide> words{};

  friend bool operator==(const BrickMask&, const BrickMask&) = default;
  [[nodiscard]] constexpr bool test(int offset) const {
    return (words[offset >> 6] >> (offset & 63)) & 1u;
  }
  void set(int offset) { words[offset >> 6] |= std::uint64_t{1} << (offset & 63); }
  void reset(int offset) { words[offset >> 6] &= ~(std::uint64_t{1} << (offset & 63)); }
  void setAll() { words.fill(~std::uint64_t{0}); }
  [[nodiscard]] int count() const {
    int n = 0;
    for (auto w : words) n += std::popcount(w);
    return n;
  }
};

/// A volume as a structure of arrays. The bricks are in strictly increasing order of Coord, and the
/// other arrays have entries for each of them.
struct SparseVolume {
  Coord origin;               ///< index coordinates of brick (0,0,0)'s first voxel; multiples of 8
  float background = 0.0f;    ///< value outside the bricks
  std::vector<Coord> bricks;  ///< brick positions relative to `origin`, in bricks, each >= 0
  VoxelArray<float> values;   ///< kBrickVoxels values for each brick, active or not
  std::vector<BrickMask> active;  ///< active voxels of each brick

  [[nodiscard]] std::size_t brickCount() const { return bricks.size(); }
  [[nodiscard]] std::span<const float> brickValues(std::size_t b) const {
    return {values.data() + b * kBrickVoxels, std::size_t(kBrickVoxels)};
  }
  [[nodiscard]] std::span<float> brickValues(std::size_t b) {
    return {values.data() + b * kBrickVoxels, std::size_t(kBrickVoxels)};
  }
  /// Index coordinates of a brick's first voxel.
  [[nodiscard]] Coord brickCorner(std::size_t b) const { return origin + bricks[b] * kBrickSide; }
};

/// The memory that holds a volume's values.
[[nodiscard]] inline VoxelMemory memoryOf(const SparseVolume& volume) {
  return volume.values.get_allocator().memory();
}

/// Index in `bricks` of the brick at a position relative to the volume's origin, if it exists.
[[nodiscard]] std::optional<std::size_t> findBrick(const SparseVolume& volume, Coord brick);
/// Index of the brick that has a voxel, index coordinates, which may be 2^32 voxels from the others.
[[nodiscard]] std::optional<std::size_t> brickWith(const SparseVolume& volume, Coord voxel);
/// The first voxels of the bricks, index coordinates.
[[nodiscard]] std::vector<Coord> brickCorners(const SparseVolume& volume);
/// A volume of bricks with these first voxels, increasing, that has the values of another one, and none that is active.
/// What the other one has not has its background.
[[nodiscard]] SparseVolume withBricks(const SparseVolume& volume,
                                      const std::vector<Coord>& corners);

/// Value at an index coordinate, which is the background outside the bricks.
[[nodiscard]] float valueAt(const SparseVolume& volume, Coord voxel);

[[nodiscard]] std::uint64_t activeVoxelCount(const SparseVolume& volume);

/// Bounding box of the active voxels, in index coordinates; empty if there are none.
[[nodiscard]] Box activeBox(const SparseVolume& volume);

/// The faces of a box that a voxel of the box touches, as bits: 1 and 2 are the faces of the lowest and of
/// the highest x, 4 and 8 those of y, 16 and 32 those of z.
[[nodiscard]] constexpr unsigned facesOf(const Box& box, Coord voxel) {
  return (voxel.x == box.min.x ? 1u : 0u) | (voxel.x == box.max.x ? 2u : 0u) |
         (voxel.y == box.min.y ? 4u : 0u) | (voxel.y == box.max.y ? 8u : 0u) |
         (voxel.z == box.min.z ? 16u : 0u) | (voxel.z == box.max.z ? 32u : 0u);
}
inline constexpr unsigned kAllFaces = 63;
/// As many voxels as there are faces of a box suffice to touch them all.
inline constexpr std::size_t kMostBoxVoxels = 6;

/// The faces of the active box that masks of a volume's bricks touch.
/// \param masks  have no voxel outside the box
[[nodiscard]] unsigned touchedFaces(const SparseVolume& volume, const Box& box,
                                    std::span<const BrickMask> masks);

/// A few active voxels of a volume that together touch faces of its active box, so that the box stays the
/// same if they stay active. A voxel that touches several faces comes first, and among equals the one that
/// differs most from the background.
/// \param box    the active box
/// \param faces  faces to touch, or all
/// \return at most kMostBoxVoxels index coordinates, increasing
[[nodiscard]] std::vector<Coord> boxVoxels(const SparseVolume& volume, const Box& box,
                                           unsigned faces = kAllFaces);

struct ValueRange {
  float min = 0.0f, max = 0.0f;

  /// The range of no value, from which a range is expanded.
  [[nodiscard]] static constexpr ValueRange none() {
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    return {kInfinity, -kInfinity};
  }
  void expand(float v) { expand({v, v}); }
  void expand(const ValueRange& r) {
    min = std::min(min, r.min);
    max = std::max(max, r.max);
  }
};
/// Smallest and largest finite value of the active voxels; both the background if none is finite.
/// \throws BadInput  there is no active voxel
[[nodiscard]] ValueRange activeRange(const SparseVolume& volume);

// Values that are missing. A reader that is asked to keep them (NonFinite::kKeep, vdb_io.h) and a decoder
// return volumes with active voxels that are NaN or infinite. Whatever computes with values leaves them out.

/// True if a voxel of the bricks is NaN or infinite.
[[nodiscard]] bool hasNonFinite(const SparseVolume& volume);

/// Makes voxels that are NaN or infinite inactive and gives them the background, so that they are empty. Bricks
/// remain, even if no voxel of them is active any more.
void dropNonFinite(SparseVolume& volume);

/// True if values are equal but for the last two bits of float32, as those of a constant that was computed in several
/// ways. Their range says nothing of them then.
[[nodiscard]] bool isConstant(const ValueRange& values);

/// The interval over which the values of a grid spread, active or not.
struct ValueSpan {
  double low = 0.0, high = 0.0;
  /// True if the background is not in the interval, because it is far from the active values.
  bool farBackground = false;

  [[nodiscard]] double length() const { return high - low; }
};

/// The span of a grid: the interval from the smallest to the largest active value, extended to the
/// background unless that is far. A background is far if it is farther from the interval than the
/// interval is long, as the background 0 of a pressure between 101,325 and 101,365 Pa, or of a
/// temperature between 280 and 310 K. Such a background says only where there is no value, and the
/// values would be lost in a span that contains it. The background of an 8-bit scan whose active
/// values begin at a threshold is not far, nor is that of a grid with one active value (isConstant).
/// \param active  range of the active values, as from activeRange
[[nodiscard]] ValueSpan spanOf(const ValueRange& active, double background);

/// spanOf() of a volume. \throws BadInput  there is no active voxel
[[nodiscard]] ValueSpan spanOf(const SparseVolume& volume);

/// The peak of the PSNR of a grid, to which its errors are relative. It is
///  - for values of one sign, their range, as in compressors of scientific data. It begins at the
///    background if that lies between 0 and the values and is not far (spanOf). For values from 0 up
///    this is the largest value;
///  - for values of both signs, the largest magnitude. A velocity from -v to v then has the peak v,
///    which does not depend on the direction of the axes, and data of both signs have the quality
///    that those of one sign have;
///  - if all active values are equal (isConstant), their magnitude, or 1 if they are 0.
/// \param active  range of the active values, as from activeRange
[[nodiscard]] double peakOf(const ValueRange& active, double background);

/// Gives a volume another background, which all inactive voxels get.
void setBackground(float background, SparseVolume& volume);

/// Drops bricks without an active voxel, and moves the origin to the smallest corner of the others.
void dropInactiveBricks(SparseVolume& volume);

/// \throws std::logic_error  the arrays differ in length, or the bricks are not in order
void checkInvariants(const SparseVolume& volume);

/// A brick as input of makeVolume.
struct BrickInput {
  Coord corner;  ///< index coordinates of the first voxel, multiples of 8
  std::array<float, kBrickVoxels> values;
  BrickMask active;
};

/// Builds a volume from bricks in any order. Bricks are sorted, bricks without an active voxel are
/// dropped, and the origin is the smallest corner. A fit therefore does not depend on the position
/// of the grid or on empty bricks around it.
/// \throws BadInput  two bricks have the same corner, or bricks are more than 2^31 voxels apart
[[nodiscard]] SparseVolume makeVolume(std::vector<BrickInput> bricks, float background);

// The sign of a level set where it has no bricks. A level set is negative inside its surface; 0 is
// outside. The space without bricks consists of regions: two bricks' places belong to the same
// region if a path leads from one to the other through faces of places without a brick.

/// Finds the regions of a volume's empty space and their signs. A region has the sign of the voxels
/// of the bricks around it that touch it. Memory and time follow the number of bricks and not the
/// bounding box.
class EmptySigns {
 public:
  explicit EmptySigns(const SparseVolume& volume);

  /// True if the voxels around every region agree in their sign, and those around the region that
  /// reaches infinity are outside. If they do not, the surface has holes in the empty space, and
  /// nothing says which side is inside.
  [[nodiscard]] bool agree() const { return agree_; }

  /// True if the place of a brick lies in a region inside the surface. Where voxels do not agree,
  /// most of them decide. The region that reaches infinity is always outside.
  /// \param brick  index corner / 8 of a place without a brick
  [[nodiscard]] bool isInside(Coord brick) const;

 private:
  /// Places without a brick between two bricks of a line along z.
  struct Gap {
    std::int32_t first = 0, last = 0;      ///< z
    std::size_t region = 0;                ///< a gap of the same region, or itself; see rootOf()
    std::int64_t inside = 0, outside = 0;  ///< voxels around the region, by their sign
  };
  /// The bricks of a line along z, and the gaps between them.
  struct Line {
    std::int32_t x = 0, y = 0, first = 0, last = 0;
    std::size_t gapsBegin = 0, gapsEnd = 0;
  };

  void findGaps(const SparseVolume& volume);
  void joinGaps();
  void join(std::size_t gap, const Line* beside);
  void unite(std::size_t a, std::size_t b);
  void countFaces(const SparseVolume& volume);
  void judge();
  [[nodiscard]] std::size_t rootOf(std::size_t gap) const;
  [[nodiscard]] const Line* lineAt(std::int32_t x, std::int32_t y) const;
  [[nodiscard]] std::size_t firstGapFrom(const Line& line, std::int32_t z) const;
  [[nodiscard]] std::size_t gapAt(Coord brick) const;

  Coord origin_;             ///< of the volume, in bricks
  std::vector<Gap> gaps_;    ///< the first one stands for everything beside and beyond the lines
  std::vector<Line> lines_;  ///< increasing
  bool agree_ = true;
};

}  // namespace esvr

// libesvr has the functions of these arrays, compiled with optimisation. Those of a program without optimisation would
// visit each voxel where an array ends, since only std::allocator says that there is nothing to do.
extern template class std::vector<float, esvr::VoxelAllocator<float>>;
extern template class std::vector<std::int32_t, esvr::VoxelAllocator<std::int32_t>>;
extern template class std::vector<std::byte, esvr::VoxelAllocator<std::byte>>;
