// Plan: files are written here in all forms that VTK writes: ascii, base64 within the XML, and
// appended data raw or in base64, each with and without zlib, in both byte orders and with lengths of
// both sizes. Then arrays, cells, transforms and damaged files.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include <sstream>

#include "cli/run_program.h"
#include "esvr/error.h"
#include "images/image_source.h"
#include "samples/whole_image.h"

namespace esvr::samples {
namespace {

using test::TemporaryFolder;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::ThrowsMessage;

std::string base64Of(const std::string& bytes) {
  constexpr const char* kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    unsigned group = 0;
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
    for (std::size_t k = 0; k < 3; ++k)
      group = group << 8 | (k < count ? std::uint8_t(bytes[i + k]) : 0u);
    for (std::size_t k = 0; k < 4; ++k)
      text += k <= count ? kDigits[(group >> (18 - 6 * k)) & 63] : '=';
  }
  return text;
}

std::string deflated(const std::string& bytes) {
  std::string out(compressBound(uLong(bytes.size())), '\0');
  auto size = uLongf(out.size());
  compress(reinterpret_cast<Bytef*>(out.data()), &size,
           reinterpret_cast<const Bytef*>(bytes.data()), uLong(bytes.size()));
  out.resize(size);
  return out;
}

/// How data is written.
struct VtiForm {
  bool big = false, wide = false, zipped = false;  ///< wide: lengths of 64 bits
  std::string format = "appended", encoding = "raw";
  std::size_t block = 16;  ///< bytes of a block before compression
};

std::string vtiLength(std::uint64_t length, const VtiForm& form) {
  return form.wide ? bytesOf(length, form.big) : bytesOf(std::uint32_t(length), form.big);
}

/// Data with its lengths before it, as bytes or base64.
std::string vtiEncoded(const std::string& data, const VtiForm& form) {
  const bool asText = form.format == "binary" || form.encoding == "base64";
  if (!form.zipped) {
    const std::string bytes = vtiLength(data.size(), form) + data;
    return asText ? base64Of(bytes) : bytes;
  }
  std::string sizes, blocks;
  for (std::size_t at = 0; at < data.size(); at += form.block) {
    const std::string block = deflated(data.substr(at, form.block));
    sizes += vtiLength(block.size(), form);
    blocks += block;
  }
  const std::string header = vtiLength((data.size() + form.block - 1) / form.block, form) +
                             vtiLength(form.block, form) +
                             vtiLength(data.size() % form.block, form) + sizes;
  return asText ? base64Of(header) + base64Of(blocks) : header + blocks;
}

/// The attributes and the content of the image, to be changed by tests.
struct VtiFile {
  VtiForm form{};
  std::string image = "WholeExtent=\"0 1 0 2 0 4\" Origin=\"0 0 0\" Spacing=\"1 1 1\"";
  std::string piece = "Extent=\"0 1 0 2 0 4\"";
  std::string group = "PointData";
  std::string array = "type=\"UInt8\" Name=\"a\"";
  std::string more{};  ///< further arrays
  std::string data{};  ///< inline or appended, vtiEncoded
};

std::string vtiText(const VtiFile& file) {
  const VtiForm& form = file.form;
  const bool appended = form.format == "appended";
  std::ostringstream out;
  out << "<?xml version=\"1.0\"?>\n<VTKFile type=\"ImageData\" version=\"1.0\" byte_order=\""
      << (form.big ? "BigEndian" : "LittleEndian") << "\" header_type=\""
      << (form.wide ? "UInt64" : "UInt32") << "\""
      << (form.zipped ? " compressor=\"vtkZLibDataCompressor\"" : "") << ">\n<ImageData "
      << file.image << ">\n<Piece " << file.piece << ">\n<" << file.group << ">\n<DataArray "
      << file.array << " format=\"" << form.format << "\""
      << (appended ? " offset=\"0\"/>"
                   : ">\n<InformationKey name=\"k\"><Value> 7 </Value></InformationKey>\n  " +
                         file.data + "\n</DataArray>")
      << file.more << "\n</" << (file.group.substr(0, file.group.find(' ')))
      << ">\n</Piece>\n</ImageData>\n";
  if (appended)
    out << "<AppendedData encoding=\"" << form.encoding << "\">\n   _" << file.data
        << "\n</AppendedData>\n";
  out << "</VTKFile>\n";
  return out.str();
}

std::unique_ptr<ImageSource> openVtiText(const TemporaryFolder& folder, const std::string& text,
                                         const ImageChoice& choice = {}) {
  test::writeText(folder / "a.vti", text);
  return openVti(folder / "a.vti", choice);
}

std::vector<VtiForm> binaryForms() {
  std::vector<VtiForm> forms;
  for (const bool big : {false, true})
    for (const bool wide : {false, true})
      for (const bool zipped : {false, true})
        for (const auto& [format, encoding] :
             {std::pair{"binary", "raw"}, {"appended", "raw"}, {"appended", "base64"}})
          forms.push_back({big, wide, zipped, format, encoding});
  return forms;
}

template <class T>
void expectVtiReads(const std::string& type, std::optional<double> maximum) {
  const auto values = countingValues<T>(30);
  for (const VtiForm& form : binaryForms()) {
    const TemporaryFolder folder;
    const auto image =
        openVtiText(folder, vtiText({.form = form,
                                     .array = "type=\"" + type + "\" Name=\"a\"",
                                     .data = vtiEncoded(bytesOf(values, form.big), form)}));
    EXPECT_EQ(image->size(), (Coord{2, 3, 5}));
    EXPECT_EQ(image->typeMaximum(), maximum);
    EXPECT_EQ(wholeImage(*image), asFloats(values))
        << type << form.format << form.encoding << form.zipped;
    EXPECT_EQ(wholeImage(*image), asFloats(values)) << "a second time";
  }
}

TEST(OpenVti, readsEveryTypeInEveryForm) {
  expectVtiReads<std::uint8_t>("UInt8", 255.0);
  expectVtiReads<std::int8_t>("Int8", 127.0);
  expectVtiReads<std::uint16_t>("UInt16", 65535.0);
  expectVtiReads<std::int16_t>("Int16", 32767.0);
  expectVtiReads<std::uint32_t>("UInt32", 4294967295.0);
  expectVtiReads<std::int32_t>("Int32", 2147483647.0);
  expectVtiReads<std::uint64_t>("UInt64", 18446744073709551615.0);
  expectVtiReads<std::int64_t>("Int64", 9223372036854775807.0);
  expectVtiReads<float>("Float32", std::nullopt);
  expectVtiReads<double>("Float64", std::nullopt);
}

TEST(OpenVti, readsAsciiAndSkipsSlices) {
  const TemporaryFolder folder;
  std::string text;
  for (int i = 0; i < 30; ++i)
    text += (i % 7 ? " " : "\n\t") + std::string(i == 3 ? "+" : "") + std::to_string(i) + ".5e0";
  const auto image = openVtiText(
      folder,
      vtiText({.form = {.format = "ascii"}, .array = "type=\"Float32\" Name=\"a\"", .data = text}));
  EXPECT_EQ(wholeImage(*image)[29], 29.5f);
  std::vector<float> slice(6);
  image->read({3, 1}, slice);
  EXPECT_THAT(slice, ElementsAre(18.5, 19.5, 20.5, 21.5, 22.5, 23.5));
  image->read({0, 1}, slice);
  EXPECT_EQ(slice[3], 3.5f);
}

TEST(OpenVti, readsAComponentThatIsChosen) {
  for (const char* format : {"ascii", "binary", "appended"}) {
    const TemporaryFolder folder;
    const VtiForm form{.format = format};
    const auto values = countingValues<std::uint8_t>(90);
    std::string text;
    for (const auto value : values) text += std::to_string(value) + " ";
    const std::string file =
        vtiText({.form = form,
                 .array = "type=\"UInt8\" Name=\"v\" NumberOfComponents=\"3\"",
                 .data = form.format == "ascii" ? text : vtiEncoded(bytesOf(values), form)});
    const auto read = wholeImage(*openVtiText(folder, file, {.component = 2}));
    for (std::size_t i = 0; i < 30; ++i) EXPECT_EQ(read[i], float(3 * i + 2)) << format;
    EXPECT_THAT([&] { (void)openVtiText(folder, file); },
                ThrowsMessage<UsageError>(HasSubstr("3 components")));
  }
}

constexpr const char* kSecondArray =
    "\n<DataArray type=\"UInt8\" Name=\"b\" format=\"appended\" offset=\"34\"/>";

TEST(OpenVti, readsTheActiveArrayOrTheOneThatIsNamed) {
  const TemporaryFolder folder;
  const VtiForm form;
  const std::string data =
      vtiEncoded(std::string(30, 1), form) + vtiEncoded(std::string(30, 2), form);
  const VtiFile none{.form = form, .more = kSecondArray, .data = data};
  EXPECT_THAT(
      [&] { (void)openVtiText(folder, vtiText(none)); },
      ThrowsMessage<UsageError>(AllOf(HasSubstr("a.vti"), HasSubstr("--dataset"),
                                      HasSubstr("'a' (1 x UInt8, points)"), HasSubstr("'b'"))));
  EXPECT_EQ(wholeImage(*openVtiText(folder, vtiText(none), {.dataset = "b"})).front(), 2.0f);
  EXPECT_THAT([&] { (void)openVtiText(folder, vtiText(none), {.dataset = "c"}); },
              ThrowsMessage<UsageError>(HasSubstr("no array 'c'")));
  const VtiFile active{
      .form = form, .group = "PointData Scalars=\"b\"", .more = kSecondArray, .data = data};
  EXPECT_EQ(wholeImage(*openVtiText(folder, vtiText(active))).front(), 2.0f);
}

TEST(OpenVti, putsPointsAndCellsWhereTheyAre) {
  const TemporaryFolder folder;
  const std::string image =
      "WholeExtent=\"10 11 0 2 0 4\" Origin=\"100 200 300\" Spacing=\"2 3 4\" Direction=\"0 -1 0 1 "
      "0 0 0 0 1\"";
  const std::string piece = "Extent=\"10 11 0 2 0 4\"";
  const auto points = openVtiText(
      folder,
      vtiText({.image = image, .piece = piece, .data = vtiEncoded(std::string(30, 1), {})}));
  EXPECT_THAT(points->indexToWorld(),
              ElementsAre(0, 2, 0, 0, -3, 0, 0, 0, 0, 0, 4, 0, 100, 220, 300, 1));
  const auto cells = openVtiText(folder, vtiText({.image = image,
                                                  .piece = piece,
                                                  .group = "CellData",
                                                  .data = vtiEncoded(std::string(8, 1), {})}));
  EXPECT_EQ(cells->size(), (Coord{1, 2, 4}));
  const auto m = cells->indexToWorld();
  EXPECT_THAT((std::array{m[12], m[13], m[14]}), ElementsAre(98.5, 221, 302));
}

TEST(OpenVti, refusesWhatItCannotRead) {
  const TemporaryFolder folder;
  const auto refuses = [&](const std::string& text, const char* reason) {
    EXPECT_THAT([&] { (void)wholeImage(*openVtiText(folder, text)); },
                ThrowsMessage<BadInput>(AllOf(HasSubstr("a.vti"), HasSubstr(reason))))
        << text;
  };
  const auto replaced = [](const std::string& from, const std::string& to) {
    std::string text = vtiText(
        {.form = {.zipped = true}, .data = vtiEncoded(std::string(30, 1), {.zipped = true})});
    return text.replace(text.find(from), from.size(), to);
  };
  refuses("", "");
  refuses("<VTKFile type=\"ImageData\">", "");
  refuses("no XML", "line 1");
  refuses(replaced("\"ImageData\"", "\"PolyData\""), "PolyData");
  refuses(replaced("vtkZLib", "vtkLZ4"), "vtkLZ4DataCompressor");
  refuses(replaced("0 1 0 2 0 4", "0 1 0 2 0"), "six numbers");
  refuses(replaced("Extent=\"0 1 0 2 0 4\">", "Extent=\"0 1 0 2 0 3\">"), "WholeExtent");
  refuses(replaced("</Piece>", "</Piece><Piece Extent=\"0 1 0 2 0 4\"/>"), "more than one piece");
  refuses(replaced("UInt8", "String"), "String");
  refuses(replaced("   _", "   x"), "underscore");
  refuses(replaced("offset=\"0\"", "offset=\"99999999\""), "missing");
  refuses(vtiText({.data = vtiEncoded(std::string(29, 1), {})}), "30 bytes");
  refuses(vtiText({.form = {.format = "binary"}, .data = "AAA!"}), "base64");
  refuses(vtiText({.form = {.format = "ascii"}, .data = "1 2 x"}), "'x' is not a number");
  refuses(vtiText({.form = {.format = "ascii"}, .data = "1 2"}), "too early");
  refuses(vtiText({.form = {.format = "hex"}, .data = "1 2"}), "'hex'");
  EXPECT_THAT([] { (void)openVti("/nowhere/a.vti", {}); },
              ThrowsMessage<BadInput>(HasSubstr("/nowhere/a.vti")));
}

TEST(OpenVti, namesTheFileThatIsCutOrDamaged) {
  for (VtiForm form : binaryForms()) {
    const TemporaryFolder folder;
    const std::string data = vtiEncoded(bytesOf(countingValues<std::uint8_t>(30)), form);
    const std::string whole = vtiText({.form = form, .data = data});
    const std::size_t end = whole.find(data) + data.size() -
                            (form.encoding == "base64" || form.format == "binary" ? 2 : 0);
    for (std::size_t length = 0; length < end; length += 41)
      EXPECT_THAT([&] { (void)wholeImage(*openVtiText(folder, whole.substr(0, length))); },
                  ThrowsMessage<BadInput>(HasSubstr("a.vti")))
          << length << form.format << form.encoding << form.zipped;
  }
}

TEST(OpenVti, findsDamagedBlocks) {
  const TemporaryFolder folder;
  const VtiForm form{.zipped = true};
  const auto values = countingValues<std::uint8_t>(30);
  const std::string data = vtiEncoded(bytesOf(values), form);
  std::size_t refused = 0;
  for (std::size_t at = 0; at < data.size(); ++at) {
    std::string damaged = data;
    damaged[at] = char(damaged[at] ^ 0x10);
    try {
      const auto image = openVtiText(folder, vtiText({.form = form, .data = damaged}));
      EXPECT_EQ(wholeImage(*image), asFloats(values)) << "a bit that means nothing";
    } catch (const BadInput&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, data.size() - 4);
}

TEST(OpenVti, refusesSizesThatDoNotFitIntoMemory) {
  const TemporaryFolder folder;
  const std::string extent = "0 2000000000 0 2000000000 0 0";
  for (const char* format : {"ascii", "appended"})
    EXPECT_THROW((void)openVtiText(folder, vtiText({.form = {.format = format},
                                                    .image = "WholeExtent=\"" + extent + "\"",
                                                    .piece = "Extent=\"" + extent + "\"",
                                                    .data = vtiEncoded("x", {})})),
                 Error);
}

}  // namespace
}  // namespace esvr::samples
