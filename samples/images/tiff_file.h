#pragma once
/// Reads single pages of a TIFF file.

#include <tiffio.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "images/element_type.h"
#include "images/stack_layout.h"

namespace esvr::samples {

/// What the pages of one stack have in common.
struct TiffFormat {
  std::uint32_t width = 0, height = 0;
  std::uint16_t bits = 1;     ///< bits of a value
  std::uint16_t samples = 1;  ///< values of a pixel
  std::uint16_t colors = 1;   ///< samples without those for opacity and the like
  std::uint16_t kind = 0;     ///< SAMPLEFORMAT_*
  friend bool operator==(const TiffFormat&, const TiffFormat&) = default;
};

/// "512 x 512 pixels of 3 x uint16".
[[nodiscard]] std::string textOf(const TiffFormat& format);

/// The type of the values; nullptr for whole numbers of 1 to 15 bits that are packed.
/// \throws BadInput  it is of no type that can be read; the text names the file
[[nodiscard]] const ElementType* typeOf(const TiffFormat& format,
                                        const std::filesystem::path& path);

class TiffFile {
 public:
  /// \throws BadInput  the file is not readable
  explicit TiffFile(std::filesystem::path path);

  /// Pages without reduced copies of others, as offsets for open().
  /// \throws BadInput  a page has another format than the first
  [[nodiscard]] std::vector<std::uint64_t> pages();

  /// Goes to a page.
  void open(std::uint64_t page);

  // The rest is about the open page, which is the first one at the beginning.
  [[nodiscard]] TiffFormat format() const;
  /// The file as the text of its first page describes it, if it has this number of pages.
  [[nodiscard]] StackFile stackFile(std::size_t pages) const;
  /// The place of the data of a page that is stored as it is; 0 for others.
  [[nodiscard]] std::uint64_t plainData() const;
  [[nodiscard]] bool isBigEndian() const;
  /// Reads one of the samples of all pixels.
  /// \throws BadInput  the page is damaged
  void read(std::size_t sample, std::span<float> out);

 private:
  struct Closer {
    void operator()(TIFF* file) const { TIFFClose(file); }
  };
  struct Piece;
  [[noreturn]] void fail() const;
  void requireReadable() const;
  [[nodiscard]] std::size_t samplesInPiece() const;
  void readStrips(std::size_t sample, std::span<float> out);
  void readTiles(std::size_t sample, std::span<float> out);
  void copyRows(const Piece& piece, std::size_t sample, std::span<float> out) const;
  std::span<const std::byte> load(bool tiled, std::uint32_t index);

  std::filesystem::path path_;
  /// The text of libtiff's last error. libtiff keeps its address, so that it must not move.
  std::unique_ptr<std::string> reason_;
  std::unique_ptr<TIFF, Closer> file_;
  std::vector<std::byte> bytes_;
};

}  // namespace esvr::samples
