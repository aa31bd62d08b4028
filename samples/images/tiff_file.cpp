#include "images/tiff_file.h"

#include <algorithm>
#include <array>
#include <cstdarg>
#include <cstdio>
#include <utility>

#include "cli/memory.h"
#include "esvr/error.h"
#include "images/image_choice.h"

namespace esvr::samples {
namespace {

namespace fs = std::filesystem;

constexpr unsigned kByteBits = 8;

/// Keeps the text of an error; libtiff calls it.
int keepReason(TIFF*, void* reason, const char*, const char* format, va_list values) {
  std::array<char, 512> text{};
  std::vsnprintf(text.data(), text.size(), format, values);
  *static_cast<std::string*>(reason) = text.data();
  return 1;
}

int ignoreWarning(TIFF*, void*, const char*, const char*, va_list) { return 1; }

struct OptionsDeleter {
  void operator()(TIFFOpenOptions* options) const { TIFFOpenOptionsFree(options); }
};

TIFF* openFile(const fs::path& path, std::string& reason) {
  const std::unique_ptr<TIFFOpenOptions, OptionsDeleter> options(TIFFOpenOptionsAlloc());
  TIFFOpenOptionsSetErrorHandlerExtR(options.get(), keepReason, &reason);
  TIFFOpenOptionsSetWarningHandlerExtR(options.get(), ignoreWarning, nullptr);
  TIFFOpenOptionsSetMaxSingleMemAlloc(options.get(), tmsize_t(cli::physicalMemory()));
  // Without m, a file that is cut while it is read would end the program.
  return TIFFOpenExt(path.c_str(), "rm", options.get());
}

template <class T>
T tagOf(TIFF* file, std::uint32_t tag, T otherwise) {
  T value = otherwise;
  return TIFFGetFieldDefaulted(file, tag, &value) ? value : otherwise;
}

const char* kindName(std::uint16_t kind) {
  switch (kind) {
    case SAMPLEFORMAT_UINT:
    case SAMPLEFORMAT_VOID:
      return "uint";
    case SAMPLEFORMAT_INT:
      return "int";
    case SAMPLEFORMAT_IEEEFP:
      return "float";
    default:
      return "complex";
  }
}

bool isPacked(const TiffFormat& format) {
  constexpr unsigned kMost = 16;
  return format.bits < kMost && format.bits != kByteBits &&
         kindName(format.kind) == std::string("uint");
}

/// Numbers of a few bits in a row, the first one in the highest bits of the first byte.
void unpackBits(const EncodedValues& values, unsigned bits, std::span<float> out) {
  std::size_t at = values.first * bits;
  for (float& number : out) {
    unsigned value = 0;
    for (std::size_t bit = at; bit < at + bits; ++bit) {
      const auto byte = std::to_integer<unsigned>(values.bytes[bit / kByteBits]);
      value = value * 2 + (byte >> (kByteBits - 1 - bit % kByteBits)) % 2;
    }
    number = float(value);
    at += values.step * bits;
  }
}

}  // namespace

std::string textOf(const TiffFormat& format) {
  return std::to_string(format.width) + " x " + std::to_string(format.height) + " pixels of " +
         std::to_string(format.samples) + " x " + kindName(format.kind) +
         std::to_string(format.bits);
}

const ElementType* typeOf(const TiffFormat& format, const fs::path& path) {
  if (isPacked(format)) return nullptr;
  try {
    return &elementType(kindName(format.kind) + std::to_string(format.bits));
  } catch (const UsageError& error) {
    throw BadInput(path.string() + ": " + error.what());
  }
}

/// A strip or a tile.
struct TiffFile::Piece {
  std::span<const std::byte> bytes;
  std::size_t rowBytes = 0;
  std::uint32_t x = 0, y = 0;           ///< its first pixel
  std::uint32_t columns = 0, rows = 0;  ///< those that are in the picture
};

TiffFile::TiffFile(fs::path path)
    : path_(std::move(path)),
      reason_(std::make_unique<std::string>("it is no TIFF file")),
      file_(openFile(path_, *reason_)) {
  if (!file_) fail();
}

void TiffFile::fail() const { throw BadInput("cannot read " + path_.string() + ": " + *reason_); }

std::vector<std::uint64_t> TiffFile::pages() {
  std::vector<std::uint64_t> found;
  TiffFormat first;
  reason_->clear();
  do {
    const auto subfile = tagOf<std::uint32_t>(file_.get(), TIFFTAG_SUBFILETYPE, 0);
    if (subfile & (FILETYPE_REDUCEDIMAGE | FILETYPE_MASK)) continue;
    if (found.empty()) first = format();
    if (format() != first)
      throw BadInput(path_.string() + ": page " + std::to_string(found.size() + 1) + " has " +
                     textOf(format()) + ", but the first one has " + textOf(first));
    found.push_back(TIFFCurrentDirOffset(file_.get()));
  } while (TIFFReadDirectory(file_.get()) == 1);
  if (!reason_->empty()) fail();
  if (found.empty()) throw BadInput(path_.string() + " has only reduced copies of pages");
  return found;
}

void TiffFile::open(std::uint64_t page) {
  if (TIFFCurrentDirOffset(file_.get()) != page && !TIFFSetSubDirectory(file_.get(), page)) fail();
}

TiffFormat TiffFile::format() const {
  TIFF* const file = file_.get();
  TiffFormat format{.width = tagOf<std::uint32_t>(file, TIFFTAG_IMAGEWIDTH, 0),
                    .height = tagOf<std::uint32_t>(file, TIFFTAG_IMAGELENGTH, 0),
                    .bits = tagOf<std::uint16_t>(file, TIFFTAG_BITSPERSAMPLE, 1),
                    .samples = tagOf<std::uint16_t>(file, TIFFTAG_SAMPLESPERPIXEL, 1),
                    .kind = tagOf<std::uint16_t>(file, TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_UINT)};
  std::uint16_t extra = 0;
  const std::uint16_t* meanings = nullptr;
  if (!TIFFGetFieldDefaulted(file, TIFFTAG_EXTRASAMPLES, &extra, &meanings)) extra = 0;
  format.colors = extra < format.samples ? std::uint16_t(format.samples - extra) : format.samples;
  return format;
}

StackFile TiffFile::stackFile(std::size_t pages) const {
  StackFile described{.path = path_, .text = {}, .pages = pages};
  const char* text = nullptr;
  if (TIFFGetField(file_.get(), TIFFTAG_IMAGEDESCRIPTION, &text) && text) described.text = text;
  described.resolution = {double(tagOf<float>(file_.get(), TIFFTAG_XRESOLUTION, 0.0f)),
                          double(tagOf<float>(file_.get(), TIFFTAG_YRESOLUTION, 0.0f))};
  return described;
}

std::uint64_t TiffFile::plainData() const {
  const auto compression = tagOf<std::uint16_t>(file_.get(), TIFFTAG_COMPRESSION, COMPRESSION_NONE);
  if (compression != COMPRESSION_NONE || TIFFIsTiled(file_.get()) || format().samples != 1)
    return 0;
  return TIFFGetStrileOffset(file_.get(), 0);
}

bool TiffFile::isBigEndian() const { return TIFFIsBigEndian(file_.get()) != 0; }

void TiffFile::requireReadable() const {
  const auto compression = tagOf<std::uint16_t>(file_.get(), TIFFTAG_COMPRESSION, COMPRESSION_NONE);
  if (!TIFFIsCODECConfigured(compression))
    throw BadInput(path_.string() + " is compressed in a way that libtiff cannot read here (" +
                   std::to_string(compression) + ")");
  if (tagOf<std::uint32_t>(file_.get(), TIFFTAG_IMAGEDEPTH, 1) > 1)
    throw BadInput(path_.string() + " has pages that are volumes; only slices can be read");
  const auto colors =
      tagOf<std::uint16_t>(file_.get(), TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
  if (colors == PHOTOMETRIC_YCBCR && compression == COMPRESSION_JPEG)
    TIFFSetField(file_.get(), TIFFTAG_JPEGCOLORMODE, JPEGCOLORMODE_RGB);
  else if (colors == PHOTOMETRIC_YCBCR)
    throw BadInput(path_.string() + " has colors in YCbCr, which can be read only in JPEG");
}

std::size_t TiffFile::samplesInPiece() const {
  const auto planes = tagOf<std::uint16_t>(file_.get(), TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
  return planes == PLANARCONFIG_SEPARATE ? 1 : format().samples;
}

void TiffFile::read(std::size_t sample, std::span<float> out) {
  requireReadable();
  if (TIFFIsTiled(file_.get()))
    readTiles(sample, out);
  else
    readStrips(sample, out);
}

std::span<const std::byte> TiffFile::load(bool tiled, std::uint32_t index) {
  const tmsize_t size = tiled ? TIFFTileSize(file_.get()) : TIFFStripSize(file_.get());
  if (size <= 0) fail();
  requireMemory(path_, "a strip or a tile", double(size));
  bytes_.resize(std::size_t(size));
  const tmsize_t read = tiled ? TIFFReadEncodedTile(file_.get(), index, bytes_.data(), size)
                              : TIFFReadEncodedStrip(file_.get(), index, bytes_.data(), size);
  if (read < 0) fail();
  return std::span(bytes_).first(std::size_t(read));
}

void TiffFile::copyRows(const Piece& piece, std::size_t sample, std::span<float> out) const {
  const TiffFormat page = format();
  const ElementType* const type = typeOf(page, path_);
  const std::size_t step = samplesInPiece();
  if (piece.bytes.size() < piece.rowBytes * piece.rows)
    throw BadInput(path_.string() + ": the rows from " + std::to_string(piece.y) + " on are cut");
  for (std::size_t row = 0; row < piece.rows; ++row) {
    const EncodedValues values{.bytes = piece.bytes.subspan(row * piece.rowBytes, piece.rowBytes),
                               .first = step == 1 ? 0 : sample,
                               .step = step};
    const auto to = out.subspan((piece.y + row) * page.width + piece.x, piece.columns);
    if (type)
      type->decode(values, to);
    else
      unpackBits(values, page.bits, to);
  }
}

void TiffFile::readStrips(std::size_t sample, std::span<float> out) {
  const TiffFormat page = format();
  const auto whole = tagOf<std::uint32_t>(file_.get(), TIFFTAG_ROWSPERSTRIP, page.height);
  const std::uint32_t rows = std::clamp(whole, 1u, page.height);
  const tmsize_t rowBytes = TIFFScanlineSize(file_.get());
  if (rowBytes <= 0) fail();
  for (std::uint32_t y = 0; y < page.height; y += std::min(rows, page.height - y)) {
    const auto bytes = load(false, TIFFComputeStrip(file_.get(), y, std::uint16_t(sample)));
    copyRows({.bytes = bytes,
              .rowBytes = std::size_t(rowBytes),
              .y = y,
              .columns = page.width,
              .rows = std::min(rows, page.height - y)},
             sample, out);
  }
}

void TiffFile::readTiles(std::size_t sample, std::span<float> out) {
  const TiffFormat page = format();
  const auto width = tagOf<std::uint32_t>(file_.get(), TIFFTAG_TILEWIDTH, 0);
  const auto height = tagOf<std::uint32_t>(file_.get(), TIFFTAG_TILELENGTH, 0);
  const tmsize_t rowBytes = TIFFTileRowSize(file_.get());
  if (width == 0 || height == 0 || rowBytes <= 0) fail();
  for (std::uint32_t y = 0; y < page.height; y += std::min(height, page.height - y))
    for (std::uint32_t x = 0; x < page.width; x += std::min(width, page.width - x)) {
      const auto index = TIFFComputeTile(file_.get(), x, y, 0, std::uint16_t(sample));
      copyRows({.bytes = load(true, index),
                .rowBytes = std::size_t(rowBytes),
                .x = x,
                .y = y,
                .columns = std::min(width, page.width - x),
                .rows = std::min(height, page.height - y)},
               sample, out);
    }
}

}  // namespace esvr::samples
