#pragma once
/// One self-contained page: no file beside it, nothing from the network.

#include <string>
#include <vector>

#include "report/data_table.h"

namespace esvr::report {

/// A picture as bytes of a file of its type, shown under a caption.
struct Picture {
  std::string caption;
  std::string type;  ///< "image/png", "image/svg+xml"
  std::string bytes;
};

/// Two pictures of one size in one place; a slider moves the border between them.
struct Slider {
  std::string caption;
  Picture reference, candidate;
};

struct HtmlPage {
  std::string title;
  std::vector<std::string> paragraphs;
  std::vector<DataTable> tables;  ///< a click on a header sorts
  std::vector<Picture> pictures;
  std::vector<Slider> sliders;
  std::vector<std::string> commands;  ///< and versions: a line each
};

/// HTML 5 in UTF-8. Whatever the texts hold, they are text.
[[nodiscard]] std::string toHtml(const HtmlPage& page);

}  // namespace esvr::report
