#pragma once
/// Fuzzer input as a file, for readers that take a path.

#include <unistd.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>

namespace esvr::fuzz {

/// A file of one process, which is replaced by each input and removed at the end.
class InputFile {
 public:
  /// \param extension  extension of the file, such as ".vdb"
  explicit InputFile(const std::string& extension)
      : path_(std::filesystem::temp_directory_path() /
              ("esvr-fuzz-" + std::to_string(::getpid()) + extension)) {}
  ~InputFile() {
    std::error_code ignored;
    std::filesystem::remove(path_, ignored);
  }
  InputFile(const InputFile&) = delete;
  InputFile& operator=(const InputFile&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

  const std::filesystem::path& write(const void* data, std::size_t size) {
    std::ofstream file(path_, std::ios::binary | std::ios::trunc);
    file.write(static_cast<const char*>(data), std::streamsize(size));
    return path_;
  }

 private:
  std::filesystem::path path_;
};

}  // namespace esvr::fuzz
