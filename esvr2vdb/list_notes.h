#pragma once
/// What --list says of metadata: who made a file, how fast its frames play, and what its numbers measure.

#include <iosfwd>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "esvr/grid.h"

namespace esvr::esvr2vdb {

/// The items that people look for, in the order of the file, as "creator Houdini 20.5, fps 24": the
/// creator, the frame rate, and every item with the word "unit" or "units" in its name.
[[nodiscard]] std::string notesOf(std::span<const MetaItem> metadata);

/// Notes of the grids of a file. Grids of the same notes are named in one line.
class GridNotes {
 public:
  void add(const std::string& grid, std::span<const MetaItem> metadata);
  /// Prints a line for each text: "density, heat: length_unit mm".
  void print(std::ostream& out) const;

 private:
  std::vector<std::string> texts_;            ///< the notes in the order in which they were added
  std::map<std::string, std::string> grids_;  ///< names by text
};

/// Prints the notes of a file in a line, if there are any.
void printFileNotes(std::span<const MetaItem> metadata, std::ostream& out);

}  // namespace esvr::esvr2vdb
