#pragma once
/// The records of all grids in one section, which is compressed as a whole (docs/format.md, "Grid
/// records").

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "format/section_reader.h"

namespace esvr::format {

/// Joins encoded grid records.
[[nodiscard]] std::vector<std::byte> putRecords(const std::vector<std::vector<std::byte>>& records);

/// The records of the grids of a file, each in its own section or all in one.
class GridRecords {
 public:
  /// \throws BadInput  the section of all records is damaged
  explicit GridRecords(SectionReader& sections);

  /// Number of grids that have a record.
  [[nodiscard]] std::uint32_t count() const;

  /// The record of a grid. It is called once for each grid that has a record, in their order.
  /// \throws BadInput
  [[nodiscard]] std::vector<std::byte> take(std::uint32_t grid);

  /// Start of the text of an error about a record.
  [[nodiscard]] std::string place(std::uint32_t grid) const;

 private:
  SectionReader& sections_;
  bool isJoined_ = false;
  std::vector<std::vector<std::byte>> joined_;
  std::size_t next_ = 0;  ///< index of the next one of them
};

}  // namespace esvr::format
