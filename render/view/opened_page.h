#pragma once
/// Opens the page in a browser.

#include <filesystem>
#include <string>

namespace esvr::view {

/// A file that leads a browser to an address, and is removed with this object. Only its owner can read
/// it, whereas every user of the machine could read the address in the browser's command line.
class OpenedPage {
 public:
  /// Opens the file by the program xdg-open.
  /// \throws UsageError      there is no such program
  /// \throws RuntimeFailure  the file cannot be written, or the program not be started
  explicit OpenedPage(const std::string& url);
  ~OpenedPage();
  OpenedPage(const OpenedPage&) = delete;
  OpenedPage& operator=(const OpenedPage&) = delete;

 private:
  std::filesystem::path file_;
};

}  // namespace esvr::view
