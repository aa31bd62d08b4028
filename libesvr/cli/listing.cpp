#include "cli/listing.h"

#include <ostream>

#include "cli/printable.h"

namespace esvr::cli {

std::string textOf(const Box& box) {
  return box.empty() ? "empty" : toString(box.min) + " to " + toString(box.max);
}

void printMetadata(const std::string& title, const std::vector<MetaItem>& items,
                   std::ostream& out) {
  for (const auto& item : items)
    out << printable(title + ": " + item.name + " (" + item.type + ")") << '\n';
}

}  // namespace esvr::cli
