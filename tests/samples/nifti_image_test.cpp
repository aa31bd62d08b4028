// Plan: headers are written byte by byte, by the layout of nifti1.h and nifti2.h. Every type, both byte
// orders, both versions, compressed files and pairs of files come back value for value; then transforms,
// scaling and damaged files.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include "cli/run_program.h"
#include "esvr/error.h"
#include "images/image_source.h"
#include "samples/whole_image.h"

namespace esvr::samples {
namespace {

namespace fs = std::filesystem;
using test::TemporaryFolder;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::ThrowsMessage;

/// Numbers of datatypes, from nifti1.h.
constexpr std::int16_t kUint8 = 2, kInt16 = 4, kInt32 = 8, kFloat32 = 16, kComplex64 = 32,
                       kFloat64 = 64, kRgb24 = 128, kInt8 = 256, kUint16 = 512, kUint32 = 768,
                       kInt64 = 1024, kUint64 = 1280, kFloat128 = 1536;

struct NiftiHeader {
  std::int16_t type = kUint8, bits = 8;
  std::vector<std::int64_t> dims{2, 3, 4};
  std::array<double, 3> spacing{1.0, 1.0, 1.0};
  double slope = 0.0, offset = 0.0;
  std::vector<double> sform{};                   ///< three rows of four
  std::array<double, 3> quaternion{}, origin{};  ///< those of the qform, if `hasQform`
  bool hasQform = false, big = false;
  bool isPair = false;
};

/// Bytes of a header, at whose places numbers are set.
class NiftiBytes {
 public:
  NiftiBytes(std::size_t size, bool big) : bytes_(size, '\0'), big_(big) {}
  template <class T>
  void set(std::size_t place, T value) {
    bytes_.replace(place, sizeof(T), bytesOf(value, big_));
  }
  void text(std::size_t place, const std::string& text) {
    bytes_.replace(place, text.size(), text);
  }
  [[nodiscard]] std::string bytes() const { return bytes_ + std::string(4, '\0'); }

 private:
  std::string bytes_;
  bool big_;
};

std::string nifti1(const NiftiHeader& h) {
  NiftiBytes bytes(348, h.big);
  bytes.set(0, std::int32_t{348});
  bytes.set(40, std::int16_t(h.dims.size()));
  for (std::size_t i = 0; i < 7; ++i)
    bytes.set(42 + 2 * i, std::int16_t(i < h.dims.size() ? h.dims[i] : 1));
  bytes.set(70, h.type);
  bytes.set(72, h.bits);
  bytes.set(76, 1.0f);
  for (std::size_t i = 0; i < 3; ++i) bytes.set(80 + 4 * i, float(h.spacing[i]));
  bytes.set(108, h.isPair ? 0.0f : 352.0f);
  bytes.set(112, float(h.slope));
  bytes.set(116, float(h.offset));
  bytes.set(252, std::int16_t(h.hasQform));
  bytes.set(254, std::int16_t(!h.sform.empty()));
  for (std::size_t i = 0; i < 3; ++i) {
    bytes.set(256 + 4 * i, float(h.quaternion[i]));
    bytes.set(268 + 4 * i, float(h.origin[i]));
  }
  for (std::size_t i = 0; i < h.sform.size(); ++i) bytes.set(280 + 4 * i, float(h.sform[i]));
  bytes.text(344, h.isPair ? "ni1" : "n+1");
  return bytes.bytes();
}

std::string nifti2(const NiftiHeader& h) {
  NiftiBytes bytes(540, h.big);
  bytes.set(0, std::int32_t{540});
  bytes.text(4, std::string("n+2\0\r\n\x1a\n", 8));
  bytes.set(12, h.type);
  bytes.set(14, h.bits);
  bytes.set(16, std::int64_t(h.dims.size()));
  for (std::size_t i = 0; i < 7; ++i)
    bytes.set(24 + 8 * i, i < h.dims.size() ? h.dims[i] : std::int64_t{1});
  bytes.set(104, 1.0);
  for (std::size_t i = 0; i < 3; ++i) bytes.set(112 + 8 * i, h.spacing[i]);
  bytes.set(168, std::int64_t{544});
  bytes.set(176, h.slope);
  bytes.set(184, h.offset);
  bytes.set(348, std::int32_t(!h.sform.empty()));
  for (std::size_t i = 0; i < h.sform.size(); ++i) bytes.set(400 + 8 * i, h.sform[i]);
  return bytes.bytes();
}

void writeZipped(const fs::path& path, const std::string& bytes) {
  gzFile file = gzopen(path.c_str(), "wb");
  ASSERT_EQ(gzwrite(file, bytes.data(), unsigned(bytes.size())), int(bytes.size()));
  gzclose(file);
}

template <class T>
void expectNiftiReads(std::int16_t type, std::optional<double> maximum) {
  const auto values = countingValues<T>(24);
  for (const bool big : {false, true}) {
    const TemporaryFolder folder;
    const NiftiHeader header{.type = type, .bits = sizeof(T) * 8, .big = big};
    test::writeText(folder / "a.nii", nifti1(header) + bytesOf(values, big));
    test::writeText(folder / "b.nii", nifti2(header) + bytesOf(values, big));
    writeZipped(folder / "c.nii.gz", nifti1(header) + bytesOf(values, big));
    for (const char* name : {"a.nii", "b.nii", "c.nii.gz"}) {
      const auto image = openNifti(folder / name, {});
      EXPECT_EQ(image->size(), (Coord{2, 3, 4}));
      EXPECT_EQ(image->typeMaximum(), maximum);
      EXPECT_EQ(wholeImage(*image), asFloats(values)) << type << ' ' << big << ' ' << name;
      EXPECT_EQ(wholeImage(*image), asFloats(values)) << "a second time";
    }
  }
}

TEST(OpenNifti, readsEveryTypeInBothByteOrdersAndBothVersions) {
  expectNiftiReads<std::uint8_t>(kUint8, 255.0);
  expectNiftiReads<std::int8_t>(kInt8, 127.0);
  expectNiftiReads<std::uint16_t>(kUint16, 65535.0);
  expectNiftiReads<std::int16_t>(kInt16, 32767.0);
  expectNiftiReads<std::uint32_t>(kUint32, 4294967295.0);
  expectNiftiReads<std::int32_t>(kInt32, 2147483647.0);
  expectNiftiReads<std::uint64_t>(kUint64, 18446744073709551615.0);
  expectNiftiReads<std::int64_t>(kInt64, 9223372036854775807.0);
  expectNiftiReads<float>(kFloat32, std::nullopt);
  expectNiftiReads<double>(kFloat64, std::nullopt);
}

TEST(OpenNifti, readsPairsOfFiles) {
  const TemporaryFolder folder;
  test::writeText(folder / "a.hdr", nifti1({.isPair = true}));
  test::writeText(folder / "a.img", bytesOf(countingValues<std::uint8_t>(24)));
  EXPECT_EQ(wholeImage(*openNifti(folder / "a.hdr", {})),
            asFloats(countingValues<std::uint8_t>(24)));
}

TEST(OpenNifti, scalesValues) {
  const TemporaryFolder folder;
  test::writeText(folder / "a.nii",
                  nifti1({.slope = 0.5, .offset = -10.0}) + std::string(24, '\4'));
  const auto image = openNifti(folder / "a.nii", {});
  EXPECT_THAT(wholeImage(*image), testing::Each(-8.0f));
  EXPECT_FALSE(image->typeMaximum()) << "it is not that of the scaled values";
}

TEST(OpenNifti, takesTheWholeMatrixOfTheSform) {
  const TemporaryFolder folder;
  const NiftiHeader header{.sform = {0, -2, 0, 10, 1, 0, 0.5, 20, 0, 0, 3, 30}};
  test::writeText(folder / "a.nii", nifti1(header) + std::string(24, 'x'));
  test::writeText(folder / "b.nii", nifti2(header) + std::string(24, 'x'));
  // world = [i j k 1] * M, so that the rows are the images of the axes.
  for (const char* name : {"a.nii", "b.nii"})
    EXPECT_THAT(openNifti(folder / name, {})->indexToWorld(),
                ElementsAre(0, 1, 0, 0, -2, 0, 0, 0, 0, 0.5, 3, 0, 10, 20, 30, 1));
}

TEST(OpenNifti, takesTheRotationOfTheQformWithoutAnSform) {
  const TemporaryFolder folder;
  const double half = std::sqrt(0.5);  // a quarter turn about z
  test::writeText(folder / "a.nii", nifti1({.spacing = {2, 3, 4},
                                            .quaternion = {0, 0, half},
                                            .origin = {7, 8, 9},
                                            .hasQform = true}) +
                                        std::string(24, 'x'));
  const auto m = openNifti(folder / "a.nii", {})->indexToWorld();
  const std::array<double, 16> want{0, 2, 0, 0, -3, 0, 0, 0, 0, 0, 4, 0, 7, 8, 9, 1};
  for (std::size_t i = 0; i < 16; ++i) EXPECT_NEAR(m[i], want[i], 1e-6) << i;
}

TEST(OpenNifti, takesTheSpacingsWithoutAnyForm) {
  const TemporaryFolder folder;
  test::writeText(folder / "a.nii", nifti1({.spacing = {0.5, 2, 4}}) + std::string(24, 'x'));
  EXPECT_THAT(openNifti(folder / "a.nii", {})->indexToWorld(),
              ElementsAre(0.5, 0, 0, 0, 0, 2, 0, 0, 0, 0, 4, 0, 0, 0, 0, 1));
}

TEST(OpenNifti, readsAVolumeOrAColorThatIsChosen) {
  const TemporaryFolder folder;
  const auto bytes = countingValues<std::uint8_t>(24);
  test::writeText(folder / "a.nii", nifti1({.dims = {2, 1, 3, 4}}) + bytesOf(bytes));
  EXPECT_THAT(wholeImage(*openNifti(folder / "a.nii", {.component = 2})),
              ElementsAre(12, 13, 14, 15, 16, 17));
  EXPECT_THAT(
      [&] { (void)openNifti(folder / "a.nii", {}); },
      ThrowsMessage<UsageError>(AllOf(HasSubstr("a.nii has 4 components"), HasSubstr("0 to 3"))));
  test::writeText(
      folder / "b.nii",
      nifti1({.type = kRgb24, .bits = 24, .dims = {2, 1, 4}, .slope = 9.0}) + bytesOf(bytes));
  EXPECT_THAT(wholeImage(*openNifti(folder / "b.nii", {.component = 1})),
              ElementsAre(1, 4, 7, 10, 13, 16, 19, 22));
  test::writeText(folder / "c.nii", nifti1({.type = kComplex64, .bits = 64, .dims = {1, 1, 2}}) +
                                        bytesOf(std::vector<float>{1, 2, 3, 4}));
  EXPECT_THAT(wholeImage(*openNifti(folder / "c.nii", {.component = 1})), ElementsAre(2, 4));
}

TEST(OpenNifti, takesASliceAsAnImageOfOneSlice) {
  const TemporaryFolder folder;
  test::writeText(folder / "a.nii", nifti1({.dims = {4, 6}}) + std::string(24, 'x'));
  EXPECT_EQ(openNifti(folder / "a.nii", {})->size(), (Coord{4, 6, 1}));
}

TEST(OpenNifti, refusesWhatIsNoImageOfNumbers) {
  const TemporaryFolder folder;
  const auto refuses = [&](const std::string& bytes, const char* reason) {
    test::writeText(folder / "bad.nii", bytes);
    EXPECT_THAT([&] { (void)openNifti(folder / "bad.nii", {}); },
                ThrowsMessage<BadInput>(AllOf(HasSubstr("bad.nii"), HasSubstr(reason))));
  };
  refuses("", "no NIfTI image");
  refuses(nifti1({}).substr(0, 300), "no NIfTI image");
  refuses(nifti1({.type = 7, .bits = 8}), "");
  refuses(nifti1({.type = kFloat128, .bits = 128}), "FLOAT128");
  EXPECT_THAT([] { (void)openNifti("/nowhere/a.nii", {}); },
              ThrowsMessage<BadInput>(HasSubstr("/nowhere/a.nii")));
}

TEST(OpenNifti, namesTheFileThatIsCut) {
  const TemporaryFolder folder;
  const std::string whole = nifti1({}) + std::string(24, 'x');
  test::writeText(folder / "cut.nii", whole.substr(0, whole.size() - 1));
  EXPECT_THAT([&] { (void)wholeImage(*openNifti(folder / "cut.nii", {})); },
              ThrowsMessage<BadInput>(AllOf(HasSubstr("cut.nii"), HasSubstr("slice 4"))));
  writeZipped(folder / "a.nii.gz", whole);
  const std::string zipped = test::readText(folder / "a.nii.gz");
  for (std::size_t length = 0; length < zipped.size() - 8; ++length) {
    test::writeText(folder / "cut.nii.gz", zipped.substr(0, length));
    EXPECT_THAT([&] { (void)wholeImage(*openNifti(folder / "cut.nii.gz", {})); },
                ThrowsMessage<BadInput>(HasSubstr("cut.nii.gz")))
        << length;
  }
}

TEST(OpenNifti, refusesSizesThatDoNotFitIntoMemory) {
  const TemporaryFolder folder;
  constexpr std::int64_t kHuge = 1 << 30;
  test::writeText(folder / "a.nii", nifti2({.dims = {kHuge, kHuge, 1}}) + "x");
  EXPECT_THROW((void)openNifti(folder / "a.nii", {}), Error);
  test::writeText(folder / "b.nii", nifti2({.dims = {kHuge, 1, kHuge}}) + "x");
  EXPECT_THROW((void)openNifti(folder / "b.nii", {}), Error);
  test::writeText(folder / "c.nii", nifti2({.dims = {-5, 2, 2}}) + "x");
  EXPECT_THAT([&] { (void)openNifti(folder / "c.nii", {}); },
              ThrowsMessage<BadInput>(HasSubstr("c.nii")));
}

}  // namespace
}  // namespace esvr::samples
