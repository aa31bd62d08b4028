#pragma once
/// Parts of the output of --list.

#include <iosfwd>
#include <string>
#include <vector>

#include "esvr/coord.h"
#include "esvr/grid_descriptor.h"

namespace esvr::cli {

/// A box as text, for example "(0, 0, 0) to (7, 7, 7)"; "empty" for an empty box.
[[nodiscard]] std::string textOf(const Box& box);

/// Prints a line with the name and the type of each item. \param title  start of each line
void printMetadata(const std::string& title, const std::vector<MetaItem>& items, std::ostream& out);

}  // namespace esvr::cli
