#pragma once
/// A self-contained HTML page, which needs no other file and no network.

#include <string>
#include <vector>

#include "report/data_table.h"

namespace esvr::report {

/// A picture as the bytes of a file, with a caption.
struct Picture {
  std::string caption;
  std::string type;  ///< "image/png", "image/svg+xml"
  std::string bytes;
};

/// Two pictures of the same size on top of each other; a slider moves the border between them.
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

/// The page as HTML 5 in UTF-8. All texts are escaped.
[[nodiscard]] std::string toHtml(const HtmlPage& page);

}  // namespace esvr::report
