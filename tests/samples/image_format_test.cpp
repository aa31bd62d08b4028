// Plan: the format of a file follows from its first bytes, then from its name, and a format whose
// library was missing is refused with the name of the package.

#include "images/image_format.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include "cli/run_program.h"
#include "esvr/error.h"

namespace esvr::samples {
namespace {

using test::TemporaryFolder;
using testing::HasSubstr;
using testing::ThrowsMessage;

struct FormatExample {
  const char* name;
  std::string bytes;
  ImageFormat format;
};
std::ostream& operator<<(std::ostream& out, const FormatExample& content) {
  return out << content.name;
}

class FormatOf : public testing::TestWithParam<FormatExample> {};

TEST_P(FormatOf, followsFromTheContentAndThenFromTheName) {
  const TemporaryFolder folder;
  test::writeText(folder / GetParam().name, GetParam().bytes);
  EXPECT_EQ(imageFormat(folder / GetParam().name), GetParam().format);
}

std::string niftiHead(const char* sign) { return std::string(344, '\0') + std::string(sign, 4); }

INSTANTIATE_TEST_SUITE_P(
    All, FormatOf,
    testing::Values(
        FormatExample{"a.raw", std::string("II*\0", 4), ImageFormat::kTiff},
        FormatExample{"b.raw", std::string("MM\0*", 4), ImageFormat::kTiff},
        FormatExample{"c.dat", std::string("II+\0", 4), ImageFormat::kTiff},
        FormatExample{"d.dat", std::string("MM\0+", 4), ImageFormat::kTiff},
        FormatExample{"e.tif", "NRRD0004\n", ImageFormat::kNrrd},
        FormatExample{"f.tif", "\x89HDF\r\n\x1a\n", ImageFormat::kHdf5},
        FormatExample{"g.mat", std::string(512, 'x') + "\x89HDF\r\n\x1a\n", ImageFormat::kHdf5},
        FormatExample{"h.raw", niftiHead("n+1"), ImageFormat::kNifti},
        FormatExample{"i.hdr", niftiHead("ni1"), ImageFormat::kNifti},
        FormatExample{"j.raw", std::string("\0\0\2\x1cn+2\0\r\n\x1a\n", 12), ImageFormat::kNifti},
        FormatExample{"k.xml", "<?xml version=\"1.0\"?>\n<VTKFile type=\"ImageData\">",
                      ImageFormat::kVti},
        FormatExample{"l.TIF", "broken", ImageFormat::kTiff},
        FormatExample{"m.Tiff", "", ImageFormat::kTiff},
        FormatExample{"n.nii", "broken", ImageFormat::kNifti},
        FormatExample{"o.nii.gz", "broken", ImageFormat::kNifti},
        FormatExample{"p.vti", "", ImageFormat::kVti},
        FormatExample{"q.h5", "", ImageFormat::kHdf5},
        FormatExample{"r.hdf5", "", ImageFormat::kHdf5},
        FormatExample{"s.nhdr", "", ImageFormat::kNrrd},
        FormatExample{"t.nrrd", "", ImageFormat::kNrrd},
        FormatExample{"u.raw", "II", ImageFormat::kRaw},
        FormatExample{"v", "", ImageFormat::kRaw}));

TEST(ImageFormat, seesNiftiThroughItsCompression) {
  const TemporaryFolder folder;
  const auto path = folder / "scan.gz";
  const std::string head = niftiHead("n+1");
  gzFile file = gzopen(path.c_str(), "wb");
  gzwrite(file, head.data(), unsigned(head.size()));
  gzclose(file);
  EXPECT_EQ(imageFormat(path), ImageFormat::kNifti);
}

TEST(ImageFormat, namesAFileThatDoesNotExist) {
  EXPECT_THAT([] { (void)imageFormat("/nowhere/a.tif"); },
              ThrowsMessage<BadInput>(
                  testing::AllOf(HasSubstr("/nowhere/a.tif"), HasSubstr("No such file"))));
}

TEST(ImageFormat, thatIsNotBuiltIsRefusedWithItsPackage) {
  const std::string text = textOfFormats();
  for (const auto& [format, package] : {std::pair{ImageFormat::kTiff, "libtiff-dev"},
                                        {ImageFormat::kNifti, "libnifti-dev"},
                                        {ImageFormat::kVti, "libexpat1-dev"},
                                        {ImageFormat::kHdf5, "libhdf5-dev"}}) {
    EXPECT_EQ(text.find(package) == std::string::npos, isBuilt(format)) << text;
    EXPECT_THAT(text, HasSubstr(nameOf(format)));
    if (isBuilt(format))
      EXPECT_NO_THROW(requireBuilt(format, "a.x"));
    else
      EXPECT_THAT([f = format] { requireBuilt(f, "a.x"); },
                  ThrowsMessage<BadInput>(testing::AllOf(HasSubstr("a.x"), HasSubstr(package))));
  }
}

}  // namespace
}  // namespace esvr::samples
