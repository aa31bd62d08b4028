#pragma once
/// The values of options: numbers, words, sizes, bounds and boxes. Every message names the option.
/// And names of the enumerations that files hold, what tells grids of one name apart, and bytes of grids.

#include <array>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/parse_text.h"
#include "esvr/container.h"
#include "esvr/ellipsoids.h"
#include "esvr/error.h"
#include "esvr/grid.h"
#include "esvr/splats.h"
#include "esvr/vdb_io.h"
#include "esvr/volume.h"
#include "programs/run_main.h"

namespace esvr::cli {

// The library's functions that parse text.
using esvr::LeadingNumber;
using esvr::parseLeadingNumber;
using esvr::parseNumber;
using esvr::parseWhole;
using esvr::splitText;

/// A word that an option takes or a report has, and what it stands for.
template <class T>
struct Choice {
  const char* word;
  T value;
};

/// \throws UsageError  always: the text lists the words that the option takes, and names the nearest one
[[noreturn]] void refuseWord(const std::string& option, const std::string& given,
                             const std::vector<std::string>& words);

/// The value of a word. \throws UsageError  the word is unknown; the message lists the known ones
template <class T>
T choose(const std::string& option, const std::string& given,
         std::initializer_list<Choice<T>> choices) {
  std::vector<std::string> words;
  for (const auto& choice : choices) {
    if (given == choice.word) return choice.value;
    words.emplace_back(choice.word);
  }
  refuseWord(option, given, words);
}

/// The word of a value; empty if it has none.
template <class T>
[[nodiscard]] const char* wordOf(T value, std::initializer_list<Choice<T>> choices) {
  for (const auto& choice : choices)
    if (choice.value == value) return choice.word;
  return "";
}

/// Parses a text like "1,-2.5,3e2" with `count` finite numbers.
/// \throws UsageError  the text is not of this form; the message names the option
[[nodiscard]] std::vector<double> parseNumbers(const std::string& option, const std::string& text,
                                               std::size_t count);

/// Parses "50000", "50KB" or "2.6MB" (units of 1000), or "48KiB" (units of 1024), in upper or lower
/// case. The size is at least 1.
/// \throws UsageError  the text is not of this form; the message names the option
[[nodiscard]] std::uint64_t parseByteSize(const std::string& option, const std::string& text);

/// Parses the memory of a GPU in the same form. A number without a unit below 1,000,000 is one of
/// gigabytes, as in the first versions of --max-vram; as bytes it would be less than a GPU can use.
/// \return at least 1,000,000
/// \throws UsageError  the text is not of this form, or the memory is less
[[nodiscard]] std::uint64_t parseDeviceMemory(const std::string& option, const std::string& text);

/// A bound in units of the values, or as a share of their range.
struct ErrorBound {
  double amount = 0.0;
  bool relative = false;  ///< `amount` is a share of the range

  [[nodiscard]] double absolute(double range) const { return relative ? amount * range : amount; }
};

/// Parses "0.01", or "1%" for a share of the range of values.
/// \throws UsageError  the text is not of this form, or not above 0; the message names the option
[[nodiscard]] ErrorBound parseErrorBound(const std::string& option, const std::string& text);

/// A bound relative to the magnitude of each value.
struct RelativeBound {
  double share = 0.0;             ///< below 1
  std::optional<double> floor{};  ///< magnitude below which the bound does not fall, above 0
};

/// Parses a share such as "1%" or "0.01", and after a comma a magnitude: "1%,0.001".
/// \throws UsageError  the text is not of this form; the message names the option
[[nodiscard]] RelativeBound parseRelativeBound(const std::string& option, const std::string& text);

/// Parses "x0,y0,z0,x1,y1,z1": the lowest and the highest voxel, both inside the box.
/// \throws UsageError  the text is not of this form, or the box is empty
[[nodiscard]] Box parseBox(const std::string& text, const std::string& option = "box");

// ---- Names of grids

/// "float", "half" or "double".
[[nodiscard]] std::string nameOf(ValueType type);
/// "continuous" or "paper".
[[nodiscard]] std::string nameOf(KernelForm form);
/// "threshold", "bricks" or "mask".
[[nodiscard]] std::string nameOf(TopologyKind kind);

/// How the active voxels of a grid of ellipsoids are found: "threshold 0.01" or "a mask".
[[nodiscard]] std::string activityOf(const StoredGrid& grid);

/// The voxels of a grid that are not finite: "12 NaN and 1 -infinity voxels".
[[nodiscard]] std::string textOf(const NonFiniteCounts& counts);

/// The type of the values of a grid of a .vdb file: "int32", "vec3s as half".
[[nodiscard]] std::string valuesOf(const GridSummary& grid);
/// The number of its active voxels; "-" if the grid is of a type that is not counted, and the
/// writer did not store the number.
[[nodiscard]] std::string activeVoxelsOf(const GridSummary& grid);

/// What tells the grids of a file apart from others of their names (pairGrids), in the order of the file.
[[nodiscard]] std::vector<GridTraits> traitsOf(const VdbSummary& file);
[[nodiscard]] std::vector<GridTraits> traitsOf(const EsvrFile& file);

/// Adds the ranges of values that are not known where they are needed, because another file has another
/// number of grids of a name.
/// \param rangeOf  reads the range of the grid at a place; nothing if it has none
void addRanges(std::span<const GridTraits> other,
               const std::function<std::optional<std::array<float, 2>>(std::size_t)>& rangeOf,
               std::vector<GridTraits>& traits);

/// Bytes of the sections that count.
[[nodiscard]] std::uint64_t bytesIf(const EsvrSummary& file,
                                    const std::function<bool(const SectionSummary&)>& counts);
/// Bytes of the sections of a grid, whether it shares them with other grids or not.
[[nodiscard]] std::uint64_t storedBytes(const EsvrSummary& file, std::size_t grid);
/// Bytes of the sections of a grid without those that an earlier section has too. The sum over the
/// grids of a file counts every byte once.
[[nodiscard]] std::uint64_t ownBytes(const EsvrSummary& file, std::size_t grid);

}  // namespace esvr::cli
