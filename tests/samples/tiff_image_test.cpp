// Plan: stacks that libtiff writes, and ones written byte by byte, come back value for value: every
// type, byte order, compression and arrangement. Channels, spacing and damaged files follow.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tiffio.h>

#include <memory>

#include "cli/run_program.h"
#include "esvr/error.h"
#include "images/image_source.h"
#include "samples/whole_image.h"

namespace esvr::samples {
namespace {

namespace fs = std::filesystem;
using test::TemporaryFolder;
using testing::AllOf;
using testing::Each;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::ThrowsMessage;

constexpr std::uint32_t kWidth = 21, kHeight = 19;  // no multiples of a tile
constexpr std::size_t kArea = kWidth * kHeight;

/// How pages are written.
struct TiffForm {
  std::uint16_t bits = 8, kind = SAMPLEFORMAT_UINT, samples = 1, compression = COMPRESSION_NONE;
  std::uint16_t planes = PLANARCONFIG_CONTIG;
  bool tiled = false;
  const char* mode = "w";
  std::string text{};
  float resolution = 0.0f;
};

void setTiffTags(TIFF* file, const TiffForm& form) {
  TIFFSetField(file, TIFFTAG_IMAGEWIDTH, kWidth);
  TIFFSetField(file, TIFFTAG_IMAGELENGTH, kHeight);
  TIFFSetField(file, TIFFTAG_BITSPERSAMPLE, form.bits);
  TIFFSetField(file, TIFFTAG_SAMPLEFORMAT, form.kind);
  TIFFSetField(file, TIFFTAG_SAMPLESPERPIXEL, form.samples);
  TIFFSetField(file, TIFFTAG_COMPRESSION, form.compression);
  TIFFSetField(file, TIFFTAG_PLANARCONFIG, form.planes);
  TIFFSetField(file, TIFFTAG_PHOTOMETRIC,
               form.samples == 3 ? PHOTOMETRIC_RGB : PHOTOMETRIC_MINISBLACK);
  if (!form.text.empty()) TIFFSetField(file, TIFFTAG_IMAGEDESCRIPTION, form.text.c_str());
  if (form.resolution > 0.0f) {
    TIFFSetField(file, TIFFTAG_XRESOLUTION, form.resolution);
    TIFFSetField(file, TIFFTAG_YRESOLUTION, form.resolution);
  }
  if (form.tiled) {
    TIFFSetField(file, TIFFTAG_TILEWIDTH, 16);
    TIFFSetField(file, TIFFTAG_TILELENGTH, 16);
  } else {
    TIFFSetField(file, TIFFTAG_ROWSPERSTRIP, 5);
  }
}

/// Writes the rows of a page, or its tiles; `sample` is the plane.
void writePlane(TIFF* file, const TiffForm& form, const std::string& page, std::uint16_t sample) {
  const std::size_t pixel = page.size() / kArea;
  if (!form.tiled) {
    for (std::uint32_t y = 0; y < kHeight; ++y) {
      std::string row = page.substr(y * kWidth * pixel, kWidth * pixel);
      ASSERT_EQ(TIFFWriteScanline(file, row.data(), y, sample), 1);
    }
    return;
  }
  for (std::uint32_t y = 0; y < kHeight; y += 16)
    for (std::uint32_t x = 0; x < kWidth; x += 16) {
      std::string tile(16 * 16 * pixel, '\x77');
      for (std::uint32_t r = 0; r < 16 && y + r < kHeight; ++r)
        tile.replace(r * 16 * pixel, std::min(16u, kWidth - x) * pixel, page,
                     ((y + r) * kWidth + x) * pixel, std::min(16u, kWidth - x) * pixel);
      ASSERT_GT(TIFFWriteTile(file, tile.data(), x, y, 0, sample), 0);
    }
}

/// Writes pages of bytes. With separate planes, a page has one after the other.
void writeTiff(const fs::path& path, const TiffForm& form, const std::vector<std::string>& pages) {
  const std::unique_ptr<TIFF, decltype(&TIFFClose)> file(TIFFOpen(path.c_str(), form.mode),
                                                         TIFFClose);
  ASSERT_TRUE(file);
  for (const std::string& page : pages) {
    setTiffTags(file.get(), form);
    const std::uint16_t planes = form.planes == PLANARCONFIG_SEPARATE ? form.samples : 1;
    for (std::uint16_t p = 0; p < planes; ++p)
      writePlane(file.get(), form, page.substr(page.size() / planes * p, page.size() / planes), p);
    TIFFWriteDirectory(file.get());
  }
}

template <class T>
std::vector<std::string> threePages(const std::vector<T>& values) {
  const std::string bytes = bytesOf(values);
  const std::size_t size = bytes.size() / 3;
  return {bytes.substr(0, size), bytes.substr(size, size), bytes.substr(2 * size)};
}

template <class T>
void expectTiffReads(TiffForm form, std::optional<double> maximum) {
  const TemporaryFolder folder;
  form.bits = sizeof(T) * 8;
  const auto values = countingValues<T>(3 * kArea);
  writeTiff(folder / "a.tif", form, threePages(values));
  const auto image = openTiff({folder / "a.tif"}, {});
  EXPECT_EQ(image->size(), (Coord{kWidth, kHeight, 3}));
  EXPECT_EQ(image->typeMaximum(), maximum);
  EXPECT_EQ(wholeImage(*image), asFloats(values))
      << form.bits << ' ' << form.kind << ' ' << form.mode;
}

TEST(OpenTiff, readsEveryTypeInBothByteOrdersAndInBigFiles) {
  for (const char* mode : {"wl", "wb", "wl8", "wb8"}) {
    expectTiffReads<std::uint8_t>({.mode = mode}, 255.0);
    expectTiffReads<std::uint16_t>({.mode = mode}, 65535.0);
    expectTiffReads<std::uint32_t>({.mode = mode}, 4294967295.0);
    expectTiffReads<std::uint64_t>({.mode = mode}, 18446744073709551615.0);
    expectTiffReads<std::int8_t>({.kind = SAMPLEFORMAT_INT, .mode = mode}, 127.0);
    expectTiffReads<std::int16_t>({.kind = SAMPLEFORMAT_INT, .mode = mode}, 32767.0);
    expectTiffReads<std::int32_t>({.kind = SAMPLEFORMAT_INT, .mode = mode}, 2147483647.0);
    expectTiffReads<std::int64_t>({.kind = SAMPLEFORMAT_INT, .mode = mode}, 9223372036854775807.0);
    expectTiffReads<float>({.kind = SAMPLEFORMAT_IEEEFP, .mode = mode}, std::nullopt);
    expectTiffReads<double>({.kind = SAMPLEFORMAT_IEEEFP, .mode = mode}, std::nullopt);
  }
}

TEST(OpenTiff, readsTilesStripsAndCompressedData) {
  for (const int compression :
       {COMPRESSION_NONE, COMPRESSION_LZW, COMPRESSION_ADOBE_DEFLATE, COMPRESSION_PACKBITS})
    for (const bool tiled : {false, true})
      expectTiffReads<std::uint16_t>({.compression = std::uint16_t(compression), .tiled = tiled},
                                     65535.0);
}

TEST(OpenTiff, readsBitsThatArePacked) {
  const TemporaryFolder folder;
  const std::string row = "\xa5\x0f\x80";  // 1010 0101 0000 1111 1
  writeTiff(folder / "a.tif", {.bits = 1},
            {std::string(kArea, '\0')});  // the rows are replaced below
  {
    const std::unique_ptr<TIFF, decltype(&TIFFClose)> file(
        TIFFOpen((folder / "a.tif").c_str(), "w"), TIFFClose);
    setTiffTags(file.get(), {.bits = 1});
    for (std::uint32_t y = 0; y < kHeight; ++y) {
      std::string copy = row;
      ASSERT_EQ(TIFFWriteScanline(file.get(), copy.data(), y, 0), 1);
    }
  }
  const auto image = openTiff({folder / "a.tif"}, {});
  EXPECT_EQ(image->typeMaximum(), 1.0);
  const auto values = wholeImage(*image);
  EXPECT_EQ(std::vector<float>(values.begin() + kWidth, values.begin() + 2 * kWidth),
            (std::vector<float>{1, 0, 1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 1, 1, 1, 1, 0, 0, 0, 0}));
}

TEST(OpenTiff, readsAColorThatIsChosen) {
  for (const int planes : {PLANARCONFIG_CONTIG, PLANARCONFIG_SEPARATE})
    for (const bool tiled : {false, true}) {
      const TemporaryFolder folder;
      const auto values = countingValues<std::uint16_t>(3 * kArea);
      writeTiff(folder / "a.tif",
                {.bits = 16, .samples = 3, .planes = std::uint16_t(planes), .tiled = tiled},
                {bytesOf(values)});
      const auto green = wholeImage(*openTiff({folder / "a.tif"}, {.component = 1}));
      ASSERT_EQ(green.size(), kArea);
      for (std::size_t i = 0; i < kArea; ++i)
        ASSERT_EQ(green[i], float(planes == PLANARCONFIG_CONTIG ? 3 * i + 1 : kArea + i)) << tiled;
    }
}

TEST(OpenTiff, refusesColorsWithoutAChoice) {
  const TemporaryFolder folder;
  writeTiff(folder / "a.tif", {.samples = 3}, {std::string(3 * kArea, 'x')});
  EXPECT_THAT([&] { (void)openTiff({folder / "a.tif"}, {}); },
              ThrowsMessage<UsageError>(AllOf(HasSubstr("3 components"), HasSubstr("0 to 2"))));
  EXPECT_THAT([&] { (void)openTiff({folder / "a.tif"}, {.component = 3}); },
              ThrowsMessage<UsageError>(HasSubstr("not 3")));
  EXPECT_THAT([&] { (void)openTiff({folder / "a.tif"}, {.dataset = "/a"}); },
              ThrowsMessage<UsageError>(HasSubstr("--dataset")));
}

TEST(OpenTiff, readsAChannelAndTheSpacingOfImageJ) {
  const TemporaryFolder folder;
  const std::string text = "ImageJ=1.53t\nimages=4\nchannels=2\nslices=2\nspacing=3\nunit=micron\n";
  writeTiff(
      folder / "a.tif", {.text = text, .resolution = 4.0f},
      {std::string(kArea, 1), std::string(kArea, 2), std::string(kArea, 3), std::string(kArea, 4)});
  const auto image = openTiff({folder / "a.tif"}, {.component = 1});
  EXPECT_EQ(image->size().z, 2);
  const auto values = wholeImage(*image);
  EXPECT_EQ(values.front(), 2.0f);
  EXPECT_EQ(values.back(), 4.0f);
  const auto m = image->indexToWorld();
  EXPECT_THAT((std::array{m[0], m[5], m[10]}), ElementsAre(0.25, 0.25, 3.0));
}

/// A big-endian file with one page of 2 x 1 values of 16 bits, written byte by byte. Data lies behind
/// the directory.
std::string imageJStack(const std::string& text, const std::string& data) {
  const auto entry = [](std::uint16_t tag, std::uint16_t type, std::uint32_t count,
                        std::string value) {
    value.resize(4, '\0');
    return bytesOf(tag, true) + bytesOf(type, true) + bytesOf(count, true) + value;
  };
  const auto number = [](std::uint16_t value) { return bytesOf(value, true); };
  const std::uint32_t directory = 8, entries = 9, textAt = directory + 2 + entries * 12 + 4;
  const auto dataAt = std::uint32_t(textAt + text.size());
  return std::string("MM\0*", 4) + bytesOf(directory, true) + number(entries) +
         entry(256, 3, 1, number(2)) + entry(257, 3, 1, number(1)) + entry(258, 3, 1, number(16)) +
         entry(259, 3, 1, number(1)) + entry(262, 3, 1, number(1)) +
         entry(270, 2, std::uint32_t(text.size()), bytesOf(textAt, true)) +
         entry(273, 4, 1, bytesOf(dataAt, true)) + entry(277, 3, 1, number(1)) +
         entry(279, 4, 1, bytesOf(std::uint32_t{4}, true)) + std::string(4, '\0') + text + data;
}

TEST(OpenTiff, readsPagesThatImageJWroteBehindTheFirstOne) {
  const TemporaryFolder folder;
  const std::string text("ImageJ=1.53t\nimages=3\nslices=3\nspacing=2\n\0", 43);
  const auto values = countingValues<std::uint16_t>(6);
  test::writeText(folder / "a.tif", imageJStack(text, bytesOf(values, true) + "more"));
  const auto image = openTiff({folder / "a.tif"}, {});
  EXPECT_EQ(image->size(), (Coord{2, 1, 3}));
  EXPECT_EQ(wholeImage(*image), asFloats(values));
  EXPECT_EQ(image->indexToWorld()[10], 2.0);
  test::writeText(folder / "cut.tif", imageJStack(text, bytesOf(values, true).substr(1)));
  EXPECT_THAT([&] { (void)openTiff({folder / "cut.tif"}, {}); },
              ThrowsMessage<BadInput>(HasSubstr("cut.tif")));
}

TEST(OpenTiff, joinsTheFilesOfAStack) {
  const TemporaryFolder folder;
  const auto values = countingValues<std::uint16_t>(3 * kArea);
  const auto pages = threePages(values);
  writeTiff(folder / "a.tif", {.bits = 16, .compression = COMPRESSION_LZW}, {pages[0], pages[1]});
  writeTiff(folder / "b.tif", {.bits = 16}, {pages[2]});
  EXPECT_EQ(wholeImage(*openTiff({folder / "a.tif", folder / "b.tif"}, {})), asFloats(values));
}

TEST(OpenTiff, refusesPagesAndFilesThatDiffer) {
  const TemporaryFolder folder;
  writeTiff(folder / "a.tif", {.bits = 16}, {std::string(2 * kArea, 'x')});
  writeTiff(folder / "b.tif", {.bits = 8}, {std::string(kArea, 'x')});
  EXPECT_THAT(
      [&] {
        (void)openTiff({folder / "a.tif", folder / "b.tif"}, {});
      },
      ThrowsMessage<BadInput>(AllOf(HasSubstr("b.tif"), HasSubstr("uint8"), HasSubstr("uint16"))));
  writeTiff(folder / "a.tif", {.bits = 8, .mode = "a"}, {std::string(kArea, 'x')});
  EXPECT_THAT([&] { (void)openTiff({folder / "a.tif"}, {}); },
              ThrowsMessage<BadInput>(AllOf(HasSubstr("a.tif"), HasSubstr("page 2"))));
}

/// Adds a page of one pixel that is marked as a reduced copy.
void addReducedCopy(const fs::path& path) {
  const std::unique_ptr<TIFF, decltype(&TIFFClose)> file(TIFFOpen(path.c_str(), "a"), TIFFClose);
  TIFFSetField(file.get(), TIFFTAG_SUBFILETYPE, FILETYPE_REDUCEDIMAGE);
  TIFFSetField(file.get(), TIFFTAG_IMAGEWIDTH, 1);
  TIFFSetField(file.get(), TIFFTAG_IMAGELENGTH, 1);
  TIFFSetField(file.get(), TIFFTAG_BITSPERSAMPLE, 8);
  TIFFSetField(file.get(), TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
  char pixel = 9;
  ASSERT_EQ(TIFFWriteScanline(file.get(), &pixel, 0, 0), 1);
}

TEST(OpenTiff, leavesOutReducedCopies) {
  const TemporaryFolder folder;
  const fs::path path = folder / "a.tif";
  addReducedCopy(path);
  EXPECT_THAT([&] { (void)openTiff({path}, {}); },
              ThrowsMessage<BadInput>(HasSubstr("only reduced copies")));
  writeTiff(path, {.mode = "a"}, {std::string(kArea, 5)});
  addReducedCopy(path);
  const auto image = openTiff({path}, {});
  EXPECT_EQ(image->size(), (Coord{kWidth, kHeight, 1}));
  EXPECT_THAT(wholeImage(*image), Each(5.0f));
}

TEST(OpenTiff, namesTheFileThatIsCutOrDamaged) {
  const TemporaryFolder folder;
  for (const int compression : {COMPRESSION_NONE, COMPRESSION_LZW, COMPRESSION_ADOBE_DEFLATE}) {
    writeTiff(folder / "a.tif", {.bits = 16, .compression = std::uint16_t(compression)},
              threePages(countingValues<std::uint16_t>(3 * kArea)));
    const std::string whole = test::readText(folder / "a.tif");
    int refused = 0;
    for (std::size_t length = 0; length < whole.size(); length += 101) {
      test::writeText(folder / "cut.tif", whole.substr(0, length));
      try {
        (void)wholeImage(*openTiff({folder / "cut.tif"}, {}));
      } catch (const BadInput& error) {
        ++refused;
        EXPECT_THAT(error.what(), HasSubstr("cut.tif"));
      }
    }
    EXPECT_GT(refused, int(whole.size() / 101) - 5)
        << "only the end of the last directory may be missing";
  }
}

TEST(OpenTiff, refusesSizesThatDoNotFitIntoMemory) {
  const TemporaryFolder folder;
  const fs::path path = folder / "a.tif";
  {
    const std::unique_ptr<TIFF, decltype(&TIFFClose)> file(TIFFOpen(path.c_str(), "w"), TIFFClose);
    setTiffTags(file.get(), {});
    TIFFSetField(file.get(), TIFFTAG_IMAGEWIDTH, 2'000'000'000);
    TIFFSetField(file.get(), TIFFTAG_IMAGELENGTH, 2'000'000'000);
    TIFFSetField(file.get(), TIFFTAG_ROWSPERSTRIP, 2'000'000'000);
    char byte = 0;
    ASSERT_EQ(TIFFWriteRawStrip(file.get(), 0, &byte, 1), 1);
  }
  EXPECT_THAT([&] { (void)wholeImage(*openTiff({path}, {})); },
              ThrowsMessage<MemoryExceeded>(HasSubstr("a.tif")));
}

}  // namespace
}  // namespace esvr::samples
