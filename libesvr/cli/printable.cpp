#include "cli/printable.h"

#include "esvr/grid_names.h"

namespace esvr::cli {

std::string printable(const std::string& text) { return shownText(text, LineEnds::kReplace); }

std::string printableMessage(const std::string& text) { return shownText(text, LineEnds::kKeep); }

}  // namespace esvr::cli
