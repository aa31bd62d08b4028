#include "render/view/page.h"

#include <fstream>
#include <iterator>
#include <span>
#include <stdexcept>

#include "esvr/error.h"
#include "programs/files.h"
#include "programs/page.h"
#include "programs/sequence.h"
#include "render/view/collection.h"

namespace esvr::view {
namespace {

namespace fs = std::filesystem;

/// The element that holds the file; it is empty in the bundle.
constexpr std::string_view kPlace =
    R"(<script id="esvr-file" type="application/octet-stream;base64" data-name=""></script>)";
constexpr std::string_view kNameEnd = R"("></script>)", kElementEnd = "</script>";

std::string bytesIn(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::string bytes{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  if (!file) throw BadInput(path.string() + ": cannot be read");
  return bytes;
}

void checkInput(const Export& what) {
  const std::string name = what.input.string();
  if (what.input.extension() != ".esvr")
    throw UsageError(name + ": a page contains an .esvr file; make one by vdb2esvr");
  if (cli::framesInFile(what.input))
    throw UsageError(name + " holds a sequence, and a page shows one frame");
  (void)showFile(what.input, what.memory);
  if (fs::file_size(what.input) > kMostExportedBytes)
    throw UsageError(name + " has more than " + std::to_string(kMostExportedBytes >> 20) +
                     " MiB, which is too large for a page");
}

}  // namespace

std::string exportedPage(std::string_view page, const std::string& name, std::string_view bytes) {
  const std::size_t place = page.find(kPlace);
  if (place == std::string_view::npos) throw std::logic_error("the page has no place for a file");
  const std::size_t nameEnd = place + kPlace.size() - kNameEnd.size();
  const std::size_t textEnd = place + kPlace.size() - kElementEnd.size();
  std::string text(page.substr(0, nameEnd));
  text += report::escaped(name);
  text += page.substr(nameEnd, textEnd - nameEnd);
  text += report::base64(bytes);
  return text.append(page.substr(textEnd));
}

void exportPage(const Export& what) {
  cli::requireSeparate({what.input}, {what.output});
  cli::checkOutput(what.output, {".html"}, what.overwrite);
  checkInput(what);
  const std::string page =
      exportedPage(exportPageBundle(), what.input.filename().string(), bytesIn(what.input));
  cli::writeBytes(what.output, std::as_bytes(std::span(page)), what.overwrite);
}

}  // namespace esvr::view
