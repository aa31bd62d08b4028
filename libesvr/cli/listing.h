#pragma once
/// Parts of what --list prints.

#include <iosfwd>
#include <string>
#include <vector>

#include "esvr/coord.h"
#include "esvr/grid_descriptor.h"

namespace esvr::cli {

/// "(0, 0, 0) to (7, 7, 7)"; "empty".
[[nodiscard]] std::string textOf(const Box& box);

/// A line an item: its name and its type. \param title  begins each line
void printMetadata(const std::string& title, const std::vector<MetaItem>& items, std::ostream& out);

}  // namespace esvr::cli
