#pragma once
/// Names of grids and of their classes. Users give names to find the grids of a file; several grids
/// may share a name or have none, and a name may look like another way to name a grid. All programs and
/// bindings find grids by the rules of GridNames, so that one name means the same grid everywhere.

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "esvr/coord.h"
#include "esvr/grid_descriptor.h"

namespace esvr {

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

/// GridNames::allUnique() of these names.
[[nodiscard]] std::vector<std::string> uniqueNames(std::span<const std::string> names);

/// GridNames::findWhole() in these names.
[[nodiscard]] std::size_t findGrid(std::span<const std::string> names, const std::string& wanted,
                                   const std::filesystem::path& file = {});

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

}  // namespace esvr
