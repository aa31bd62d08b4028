#pragma once
/// What the fuzzers of this folder share: their table, files of inputs, and checksums that are correct.

#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace esvr::fuzz {

/// Reads one input. It returns 0 as libFuzzer wants it, and aborts if the input shows a fault.
using Fuzzer = int (*)(const std::uint8_t* data, std::size_t size);

/// Adds a fuzzer to the table of the program. \return true
bool addFuzzer(std::string_view name, Fuzzer fuzzer);

/// \return the fuzzer with this name; null if the program has none
[[nodiscard]] Fuzzer findFuzzer(std::string_view name);

/// Begins the definition of a fuzzer, whose body reads `size` bytes at `data`.
#define ESVR_FUZZER(name)                                                     \
  int name##Fuzzer(const std::uint8_t* data, std::size_t size);               \
  [[maybe_unused]] const bool name##IsAdded = addFuzzer(#name, name##Fuzzer); \
  int name##Fuzzer(const std::uint8_t* data, std::size_t size)

/// Aborts if an input has shown a fault.
inline void require(bool holds) {
  if (!holds) std::abort();
}

/// A copy with the correct size, version, magic number and checksums, as far as header and table
/// lie in the file. Without it a fuzzer would never get past the first checksum.
[[nodiscard]] std::vector<std::byte> repaired(std::span<const std::byte> bytes);

/// Input of a reader that takes a path.
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
