#pragma once
/// Grids: volumes with a name, a class and a transform, as the files of applications have them.

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <unordered_map>
#include <utility>
#include <variant>
#include <vector>

#include "esvr/volume.h"

namespace esvr {

// The properties of a grid besides its voxels: all that is needed to restore the grid in a VDB
// file.

/// A VDB metadata item. Its value is kept as the bytes that OpenVDB writes, so that every type is
/// preserved.
struct MetaItem {
  std::string name;
  std::string type;              ///< OpenVDB's type name: "string", "float", "vec3s", ...
  std::vector<std::byte> value;  ///< bytes of Metadata::write without the leading size
  friend bool operator==(const MetaItem&, const MetaItem&) = default;
};

enum class GridClass { kUnknown = 0, kLevelSet = 1, kFogVolume = 2, kStaggered = 3 };

/// The value type of the source; a fit works in float32.
enum class ValueType {
  kFloat = 0,
  kHalf = 1,    ///< a FloatGrid that was saved as half
  kDouble = 2,  ///< rounded to float32, with a relative error of at most 6e-8
};

/// The index-to-world map of a grid.
struct Transform {
  std::string mapType;  ///< OpenVDB's name: "UniformScaleMap", "AffineMap", "NonlinearFrustumMap"
  std::vector<std::byte> map;  ///< the map as OpenVDB serialises it (math::MapBase::write)
  /// Affine 4x4 matrix for row vectors (world = [i j k 1] * M, row major), for readers without
  /// OpenVDB. It is missing if the map is not linear (a frustum).
  std::optional<std::array<double, 16>> affine;
  friend bool operator==(const Transform&, const Transform&) = default;
};

struct GridDescriptor {
  std::string name;  ///< name in the grid's own metadata; not necessarily unique
  GridClass gridClass = GridClass::kUnknown;
  ValueType valueType = ValueType::kFloat;
  double background = 0.0;
  Transform transform;
  std::vector<MetaItem> metadata;  ///< all items except those that a writer regenerates (file_*)
  friend bool operator==(const GridDescriptor&, const GridDescriptor&) = default;
};

// Names of grids and of their classes. Users give names to find the grids of a file; several grids
// may share a name or have none, and a name may look like another way to name a grid. All programs and
// bindings find grids by the rules of GridNames, so that one name means the same grid everywhere.

/// OpenVDB's names: "level set", "fog volume", "staggered", "unknown".
[[nodiscard]] const char* className(GridClass gridClass);

/// Whether the line ends of a text are shown as they are.
enum class LineEnds { kReplace, kKeep };

/// Text of unknown origin as valid UTF-8 that cannot control a terminal or change the order of the
/// text around it: bytes that are not UTF-8, control characters (U+0000 to U+001F, U+007F to U+009F),
/// separators of lines (U+2028, U+2029) and marks of the writing direction (U+061C, U+200E, U+200F,
/// U+202A to U+202E, U+2066 to U+2069) become '?'.
[[nodiscard]] std::string shownText(std::string_view text, LineEnds lineEnds);

/// The name of a grid in messages: shownText() without line ends, or "(unnamed)" if it is empty.
[[nodiscard]] std::string shownName(std::string_view name);

/// A grid that a user has named, or a component of a grid of vectors.
struct NamedGrid {
  std::size_t place = 0;                   ///< number of grids before it in the file
  std::optional<std::size_t> component{};  ///< 0, 1 or 2
  friend bool operator==(const NamedGrid&, const NamedGrid&) = default;
};

/// The names of the grids of a file. A grid is named in one of these ways; the first that applies
/// counts:
///   NAME       the only grid with this very name. If several grids have it, the name is ambiguous;
///   a unique name, as unique() and ofComponent() give it;
///   NAME[i]    number i, from 0, of the grids with the name NAME;
///   NAME#n     grid number n of the file, counted from 1, if its name is NAME;
///   GRID.x     component x, y or z of a grid that is named in one of the ways above.
/// A grid without a name has the NAME "(unnamed)" as well as "".
class GridNames {
 public:
  /// \param names  stored names of all grids of a file, in its order
  explicit GridNames(std::vector<std::string> names);

  [[nodiscard]] std::size_t size() const { return names_.size(); }

  /// The name that programs show for a grid and that finds this grid only: its name where no other
  /// grid has it, otherwise NAME[i] or, if a grid has that very name, NAME#n. It is a shownName().
  [[nodiscard]] const std::string& unique(std::size_t place) const { return unique_.at(place); }
  [[nodiscard]] const std::vector<std::string>& allUnique() const { return unique_; }
  /// The same for a component (0, 1 or 2) of a grid of vectors: "vel.x", or "vel[0].x" if a grid of
  /// the file is called "vel.x".
  [[nodiscard]] std::string ofComponent(std::size_t place, std::size_t component) const;

  /// Takes constant time. Whether a grid has components is for the caller to check.
  /// \return nothing if there is no such grid, or the name is ambiguous
  [[nodiscard]] std::optional<NamedGrid> lookUp(const std::string& wanted) const;
  /// The same. Whether a grid has components is for the caller to check.
  /// \param file  file name for the error's text; empty if the caller adds it
  /// \throws BadInput  there is no such grid, or the name is ambiguous; the text lists grids
  [[nodiscard]] NamedGrid find(const std::string& wanted,
                               const std::filesystem::path& file = {}) const;
  /// True if several grids have this very name and none of them is meant.
  [[nodiscard]] bool isAmbiguous(const std::string& wanted) const;
  /// The unique names in quotes for a message, which leaves out most of very many; "none" without any.
  [[nodiscard]] std::string list() const;
  /// The place of a grid, where components cannot be named. \throws BadInput  as for find
  [[nodiscard]] std::size_t findWhole(const std::string& wanted,
                                      const std::filesystem::path& file = {}) const;

 private:
  using Places = std::vector<std::size_t>;

  void nameUniquely();
  [[nodiscard]] std::string baseOf(std::size_t place) const;
  [[nodiscard]] bool isTaken(const std::string& name) const;
  [[nodiscard]] std::optional<std::size_t> numbered(const std::string& wanted) const;
  [[nodiscard]] std::optional<std::size_t> placed(const std::string& wanted) const;
  [[nodiscard]] const Places* withName(const std::string& name) const;
  [[nodiscard]] std::optional<std::size_t> wholeGrid(const std::string& wanted) const;
  [[noreturn]] void refuse(const std::string& wanted, const std::filesystem::path& file) const;

  std::vector<std::string> names_, unique_;
  std::unordered_map<std::string, Places> places_;  ///< by stored name
  std::vector<std::size_t> number_;                 ///< of a grid among those with its name
  std::unordered_map<std::string, std::size_t> byUnique_;
};

/// What tells grids of one name apart.
struct GridTraits {
  std::string name;         ///< stored name
  std::string valueType{};  ///< OpenVDB's name: "float", "vec3s", ...
  GridClass gridClass = GridClass::kUnknown;
  std::uint64_t activeVoxels = 0;
  Box activeBox{};
  /// The smallest and the largest active value (of vectors: of component x), if they are known.
  std::optional<std::array<float, 2>> values{};
};

/// Finds the grids of one file in another file that was made from it and may lack some of them. Grids
/// have the same name, and keep their order. If a file has fewer grids of a name than the other, those
/// are paired that agree in most traits, because the others may be missing anywhere.
/// \return for each grid of the reference, the place of the same grid in the candidate
[[nodiscard]] std::vector<std::optional<std::size_t>> pairGrids(
    std::span<const GridTraits> reference, std::span<const GridTraits> candidate);

// The values of a grid's inactive voxels and tiles that are not the background. A SparseVolume does
// not hold them, and neither does a converted grid; a carried grid does. Applications differ in what
// they make of them: OpenVDB's tools skip them, Blender draws those in leaves with active voxels.

/// Counts values and remembers enough of them to compare two grids. In a level set, the background
/// with a negative sign is not counted where a writer restores it: beside active voxels, and elsewhere if the signs of the
/// empty space agree (EmptySigns::agree).
class InactiveValues {
 public:
  /// Adds the value of a voxel.
  void add(double value, Coord voxel) { add(value, Box{voxel, voxel}); }
  /// Adds the value of all voxels of a tile. The time follows the side of the tile in blocks of 128.
  void add(double value, const Box& tile);
  void add(const InactiveValues& others);
  /// The values of a component of vectors, which differ from equal ones of another component.
  [[nodiscard]] InactiveValues ofComponent(std::size_t component) const;

  /// Number of values, with one for every voxel of a tile.
  [[nodiscard]] std::uint64_t count() const { return count_; }
  [[nodiscard]] double min() const { return min_; }  ///< of the finite values; 0 if there is none
  [[nodiscard]] double max() const { return max_; }
  [[nodiscard]] std::uint64_t nonFinite() const { return nonFinite_; }
  [[nodiscard]] Coord first() const { return first_; }  ///< one of the voxels

  /// True if two grids have the same values at the same voxels. The division into leaves and tiles
  /// does not matter. Different grids are equal with a probability of about 2^-64.
  friend bool operator==(const InactiveValues& a, const InactiveValues& b) {
    return a.count_ == b.count_ && a.digest_ == b.digest_;
  }

 private:
  std::uint64_t count_ = 0, nonFinite_ = 0;
  double min_ = 0.0, max_ = 0.0;
  Coord first_{};
  /// The sum of f(value) g(x) g(y) g(z) over the voxels, with hashes f and g, modulo 2^64. The sum
  /// over a tile is a product of sums along the axes.
  std::uint64_t digest_ = 0;
};

/// For messages: "2 inactive values (5, first at (1, 2, 3))", "9 inactive values (-2.5 to -2, ...)".
[[nodiscard]] std::string toText(const InactiveValues& values);

/// Smaller floats have fewer digits.
inline constexpr double kLeastNormalFloat = 0x1p-126;

/// What active doubles lose because a volume holds floats; nothing for the values of other grids.
struct Narrowing {
  InactiveValues errors;  ///< value - float(value) at the voxels where it is not 0
  double squares = 0.0;   ///< sum of the squared errors
  double relative = 0.0;  ///< largest error relative to its value, at least to kLeastNormalFloat
  double min = std::numeric_limits<double>::infinity();  ///< of the doubles
  double max = -min;

  void add(double value, float rounded, Coord at) {
    min = std::min(min, value);
    max = std::max(max, value);
    if (double(rounded) != value) addError(value, value - double(rounded), at);
  }
  [[nodiscard]] double largest() const { return std::max(-errors.min(), errors.max()); }
  /// At least the largest error relative to magnitudes, smaller ones of which count as `floor` (nothing: as
  /// leastMagnitude() in metrics.h, if they are not all below kLeastNormalFloat).
  [[nodiscard]] double relativeAbove(const std::optional<double>& floor) const {
    constexpr double kUnknown = 1.0;
    if (errors.count() > 0 && !floor && std::max(-min, max) < kLeastNormalFloat) return kUnknown;
    return floor ? std::min(relative, largest() / *floor) : relative;
  }

 private:
  void addError(double value, double error, Coord at);
};

using VectorNarrowing = std::array<Narrowing, 3>;  ///< of three components

/// By how much the values of two grids can differ more than their floats: not at all if the same is lost.
[[nodiscard]] Narrowing between(const Narrowing& a, const Narrowing& b);
[[nodiscard]] VectorNarrowing between(const VectorNarrowing& a, const VectorNarrowing& b);

/// A grid of numbers with its voxels.
struct VolumeGrid {
  GridDescriptor descriptor;
  SparseVolume volume;
  std::uint64_t nonFiniteReplaced = 0;  ///< voxels that a reader replaced (NonFinite, vdb_io.h)
  InactiveValues inactive{};            ///< of the file; the volume does not hold them
  Narrowing narrowing{};
};

// Grids of vectors. A vector grid is read, fitted and stored as three volumes, one for each
// component.

inline constexpr std::size_t kComponents = 3;

/// The components x, y and z. They may have different bricks and active masks.
using VectorVolume = std::array<SparseVolume, kComponents>;

struct VectorGrid {
  GridDescriptor descriptor;  ///< its background is that of component x
  std::array<double, kComponents> background{};
  VectorVolume components;
  std::uint64_t nonFiniteReplaced = 0;  ///< components replaced as NonFinite says
  InactiveValues inactive{};            ///< of the components together
  VectorNarrowing narrowing{};
};

/// The name of a component: that of the grid with ".x", ".y" or ".z".
/// \param component  0, 1 or 2
[[nodiscard]] std::string componentName(const std::string& grid, std::size_t component);

/// The same volumes with the bricks and the active voxels that any of them has. Voxels that are
/// added to a volume have its background.
[[nodiscard]] VectorVolume aligned(const VectorVolume& vectors);

/// The lengths of the vectors, at the voxels that are active in any component. Sums of squares are
/// formed in float64.
[[nodiscard]] SparseVolume magnitudeOf(const VectorVolume& vectors);

// Grids of which only the active voxels are in memory, in the type that they have in a .vdb file:
// numbers, integers with all their bits, masks and vectors. An image becomes such a grid slab by
// slab, so that neither the image nor the inactive voxels of its bricks are ever in memory as a
// whole. A fit needs a SparseVolume; unpacked() makes one of numbers.

using PackedVector = std::array<float, kComponents>;

/// A brick with an active voxel.
struct PackedBrick {
  Coord corner;  ///< index coordinates of the first voxel, multiples of 8
  BrickMask active;
  std::uint32_t part = 0;   ///< the array that holds the values of the active voxels
  std::uint64_t first = 0;  ///< index of the first one in it
};

/// What a brick takes besides its values until its grid is written: its entry here, and OpenVDB's leaf
/// without voxels.
inline constexpr std::uint64_t kBytesPerPackedBrick = sizeof(PackedBrick) + 160;

/// The voxels of a grid.
/// \tparam T  float, double, std::int32_t, std::int64_t, PackedVector, or bool for a mask, whose
///            active voxels are all true and take no memory
template <class T>
struct PackedVoxels {
  T background{};
  std::vector<PackedBrick> bricks;  ///< Their corners increase strictly.
  /// Values of active voxels, in the order of voxelOffset in each brick.
  std::vector<std::vector<T>> parts;

  /// The value of the n-th active voxel of brick b.
  [[nodiscard]] T value(std::size_t b, int n) const {
    if constexpr (std::is_same_v<T, bool>)
      return true;
    else
      return parts[bricks[b].part][bricks[b].first + std::size_t(n)];
  }
};

using AnyPackedVoxels =
    std::variant<PackedVoxels<float>, PackedVoxels<double>, PackedVoxels<std::int32_t>,
                 PackedVoxels<std::int64_t>, PackedVoxels<bool>, PackedVoxels<PackedVector>>;

/// The descriptor's value type and background have no meaning.
struct PackedGrid {
  GridDescriptor descriptor;
  AnyPackedVoxels voxels;
};

/// OpenVDB's name of the type: "float", "double", "int32", "int64", "bool" or "vec3s".
[[nodiscard]] std::string valueTypeOf(const PackedGrid& grid);
[[nodiscard]] std::span<const PackedBrick> bricksOf(const PackedGrid& grid);
[[nodiscard]] std::uint64_t activeVoxelCount(const PackedGrid& grid);
/// Bounding box of the active voxels; empty if there are none.
[[nodiscard]] Box activeBox(const PackedGrid& grid);

/// Calls visit(offset) for the active voxels of a brick in the order of voxelOffset.
template <class Visit>
void forEachActive(const BrickMask& mask, Visit&& visit) {
  for (int x = 0; x < kBrickSide; ++x)
    for (std::uint64_t word = mask.words[std::size_t(x)]; word; word &= word - 1)
      visit(x * 64 + std::countr_zero(word));
}

/// The active voxels of a volume: doubles if its descriptor says that the source was double, else
/// floats. The sign that inactive voxels of a level set have is lost.
[[nodiscard]] PackedGrid packed(const GridDescriptor& descriptor, const SparseVolume& volume);
/// The vectors of the voxels that are active in any component, as floats.
[[nodiscard]] PackedGrid packed(const VectorGrid& vectors);
/// \throws BadInput  bricks are more than 2^31 voxels apart
[[nodiscard]] SparseVolume unpacked(const PackedVoxels<float>& voxels);

/// A box of an image in memory, in any order of its axes.
template <class Source>
struct ImageBox {
  const Source* voxels = nullptr;  ///< the voxel at `corner`
  std::array<std::ptrdiff_t, 3>
      strides{};  ///< elements from a voxel to the next one along each axis
  Coord corner;   ///< multiples of 8
  Coord size;
  /// Says which voxels are active, with strides of its own; null: PackingRule decides.
  const bool* active = nullptr;
  std::array<std::ptrdiff_t, 3> activeStrides{};
};

/// Where a box does not say which voxels are active, a voxel is active if it is not below the
/// threshold, or, without a threshold, if it differs from the background. NaN is below every threshold
/// and differs from every background. A vector has no threshold and is active if any component
/// differs. Of a mask, only true voxels are ever active.
struct PackingRule {
  std::optional<double> threshold{};
  std::uint64_t maxBytes = std::uint64_t{16} << 30;  ///< memory of the grid until it is written
};

/// Makes a grid of boxes of an image that do not overlap, and of which each brick of 8^3 voxels has
/// voxels of one box only.
/// \tparam T  the type of the grid (PackedVoxels)
/// No value is rounded, so that T decides which types an image may have:
///   float         8 and 16 bits, float
///   double        8 to 32 bits, float, double
///   std::int32_t  8 to 32 bits with a sign, 8 and 16 bits without one
///   std::int64_t  8 to 64 bits with a sign, 8 to 32 bits without one
///   bool          bool
///   PackedVector  float, given as the boxes of the three components
template <class T>
class GridPacker {
 public:
  GridPacker(T background, const PackingRule& rule) : rule_(rule) { made_.background = background; }

  /// \param components  the boxes of a vector's components; one box for all other types
  /// \throws UsageError      the corner is not a multiple of 8, or the box ends outside the index space
  /// \throws MemoryExceeded  the grid needs more memory than the rule allows
  template <class Source>
  void add(std::span<const ImageBox<Source>> components);

  /// The grid. The packer is empty afterwards. \throws UsageError  two boxes have voxels of one brick
  [[nodiscard]] PackedVoxels<T> finish();

 private:
  PackingRule rule_;
  PackedVoxels<T> made_;
  std::uint64_t valueBytes_ = 0;
};

// A grid that is not converted but carried: the bytes that OpenVDB wrote for it, which come back
// bit for bit. Any type of grid can be carried, also one that OpenVDB does not know.

struct CarriedGrid {
  std::string name;          ///< name in the grid's own metadata; not necessarily unique
  std::string treeType;      ///< OpenVDB's name: "Tree_vec3s_5_4_3", "Tree_ptdataidx32_5_4_3", ...
  bool savedAsHalf = false;  ///< whether the .vdb file says that its values are half floats
  std::uint32_t vdbVersion = 0;  ///< version of the VDB format that the bytes have: 222 to 224, ...
  /// Number of grids before this one in the file that has it. The grids of a file are in the order
  /// of their places, and those that are not carried take the places that are left.
  std::uint32_t place = 0;
  /// Position in `bytes` where the values of the tree begin, as the .vdb file says.
  std::uint64_t blocksAt = 0;
  /// The grid as in a .vdb file: flags of the compression, metadata, transform and tree. A grid
  /// that shares the tree of another grid has a copy of it.
  VoxelArray<std::byte> bytes;

  friend bool operator==(const CarriedGrid&, const CarriedGrid&) = default;
};

}  // namespace esvr
