#pragma once
/// Reads a file that may be compressed with gzip.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>

struct gzFile_s;

namespace esvr::samples {

class ZippedFile {
 public:
  /// \throws BadInput  the file cannot be opened
  explicit ZippedFile(std::filesystem::path path);

  /// Reads at a place in the decompressed bytes. Going forward is quick, going back is not.
  /// \return the number of bytes; fewer than wanted at the end of the file
  /// \throws BadInput  the compressed data is damaged
  std::size_t read(std::uint64_t place, std::span<std::byte> out);

 private:
  struct Closer {
    void operator()(gzFile_s* file) const;
  };
  std::filesystem::path path_;
  std::unique_ptr<gzFile_s, Closer> file_;
};

}  // namespace esvr::samples
