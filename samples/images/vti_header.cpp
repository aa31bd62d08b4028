#include "images/vti_header.h"

#include <expat.h>

#include <algorithm>
#include <charconv>
#include <fstream>
#include <memory>
#include <optional>
#include <string_view>
#include <type_traits>

#include "cli/number.h"
#include "esvr/error.h"

namespace esvr::samples {
namespace {

constexpr std::string_view kBlank = " \t\r\n";

/// The attributes of an element.
class Attributes {
 public:
  explicit Attributes(const XML_Char** list) : list_(list) {}

  [[nodiscard]] std::optional<std::string> find(std::string_view name) const {
    for (const XML_Char** at = list_; *at; at += 2)
      if (name == *at) return at[1];
    return std::nullopt;
  }
  [[nodiscard]] std::string get(std::string_view name) const { return find(name).value_or(""); }

 private:
  const XML_Char** list_;  ///< names and values in turn, then a null
};

/// Reads numbers with blanks between them; false if there are not as many.
template <std::size_t n>
bool readNumbers(const std::string& text, std::array<double, n>& numbers) {
  std::size_t at = 0;
  for (double& number : numbers) {
    at = text.find_first_not_of(kBlank, at);
    if (at == std::string::npos) return false;
    const std::size_t end = std::min(text.find_first_of(kBlank, at), text.size());
    const auto parsed = cli::parseNumber(text.substr(at, end - at));
    if (!parsed) return false;
    number = *parsed;
    at = end;
  }
  return text.find_first_not_of(kBlank, at) == std::string::npos;
}

struct ParserDeleter {
  void operator()(XML_Parser parser) const { XML_ParserFree(parser); }
};
using ParserPointer = std::unique_ptr<std::remove_pointer_t<XML_Parser>, ParserDeleter>;

/// Collects the header from the events of the XML parser. An exception must not pass through the
/// parser, so that the first fault is kept and ends the parsing.
class HeaderReader {
 public:
  HeaderReader() : parser_(XML_ParserCreate(nullptr)) {
    if (!parser_) throw MemoryExceeded("there is no memory for an XML parser");
    XML_SetUserData(parser_.get(), this);
    XML_SetElementHandler(
        parser_.get(),
        [](void* self, const XML_Char* name, const XML_Char** attributes) {
          static_cast<HeaderReader*>(self)->beginElement(name, Attributes(attributes));
        },
        [](void* self, const XML_Char*) { static_cast<HeaderReader*>(self)->endElement(); });
    XML_SetCharacterDataHandler(parser_.get(), [](void* self, const XML_Char* text, int length) {
      static_cast<HeaderReader*>(self)->characters({text, std::size_t(length)});
    });
  }

  /// Takes the next bytes. \return false if no more are wanted
  bool take(std::string_view bytes, bool isLast) {
    if (XML_Parse(parser_.get(), bytes.data(), int(bytes.size()), isLast) != XML_STATUS_OK &&
        fault_.empty() && header_.appended == 0)
      fault_ = std::string(XML_ErrorString(XML_GetErrorCode(parser_.get()))) + " in line " +
               std::to_string(XML_GetCurrentLineNumber(parser_.get()));
    return fault_.empty() && header_.appended == 0;
  }

  [[nodiscard]] const std::string& fault() const { return fault_; }
  [[nodiscard]] bool foundImage() const { return pieces_ == 1; }
  VtiHeader takeHeader() { return std::move(header_); }

 private:
  void stop(const std::string& fault) {
    if (fault_.empty()) fault_ = fault;
    XML_StopParser(parser_.get(), XML_FALSE);
  }
  [[nodiscard]] std::uint64_t place() const {
    return std::uint64_t(std::max<XML_Index>(XML_GetCurrentByteIndex(parser_.get()), 0));
  }

  void beginElement(std::string_view name, const Attributes& attributes) {
    if (!fault_.empty()) return;
    endText();
    ++depth_;
    if (name == "VTKFile") beginFile(attributes);
    if (name == "ImageData") beginImage(attributes);
    if (name == "Piece") beginPiece(attributes);
    if (name == "PointData" || name == "CellData") beginGroup(name, attributes);
    if (name == "DataArray" && inGroup_) beginArray(attributes);
    if (name == "AppendedData") beginAppended(attributes);
  }

  void endElement() {
    if (!fault_.empty()) return;
    endText();
    if (depth_ == arrayDepth_) arrayDepth_ = 0;
    if (depth_ == groupDepth_) inGroup_ = false;
    --depth_;
  }

  /// Data begins with the first character of an array that is not blank. Elements of the array may
  /// lie before and behind it.
  void characters(std::string_view text) {
    if (arrayDepth_ == 0 || depth_ != arrayDepth_ || header_.arrays.back().begin != 0) return;
    if (text.find_first_not_of(kBlank) != std::string_view::npos)
      header_.arrays.back().begin = place();
  }
  void endText() {
    if (arrayDepth_ == 0 || depth_ != arrayDepth_) return;
    VtiArray& array = header_.arrays.back();
    if (array.begin != 0 && array.end == 0) array.end = place();
  }

  void beginFile(const Attributes& attributes) {
    const std::string type = attributes.get("type"), compressor = attributes.get("compressor");
    if (type != "ImageData") stop("it holds " + type + " and not ImageData");
    header_.bigEndian = attributes.get("byte_order") == "BigEndian";
    header_.lengthBytes = attributes.get("header_type") == "UInt64" ? 8 : 4;
    header_.compressed = !compressor.empty();
    if (header_.compressed && compressor != "vtkZLibDataCompressor")
      stop("it is compressed by " + compressor + "; only vtkZLibDataCompressor can be read");
  }

  void beginImage(const Attributes& attributes) {
    if (!readNumbers(attributes.get("WholeExtent"), header_.extent))
      return stop("its WholeExtent is not six numbers");
    readOptional(attributes, "Origin", header_.origin);
    readOptional(attributes, "Spacing", header_.spacing);
    readOptional(attributes, "Direction", header_.direction);
  }

  template <std::size_t n>
  void readOptional(const Attributes& attributes, const char* name, std::array<double, n>& to) {
    const auto text = attributes.find(name);
    if (text && !readNumbers(*text, to))
      stop(std::string(name) + " is not " + std::to_string(n) + " numbers");
  }

  void beginPiece(const Attributes& attributes) {
    std::array<double, 6> extent{};
    if (++pieces_ > 1) return stop("it has more than one piece");
    if (!readNumbers(attributes.get("Extent"), extent) || extent != header_.extent)
      stop("its piece has not the WholeExtent");
  }

  void beginGroup(std::string_view name, const Attributes& attributes) {
    inGroup_ = true;
    groupDepth_ = depth_;
    ofCells_ = name == "CellData";
    (ofCells_ ? header_.activeOfCells : header_.activeOfPoints) = attributes.get("Scalars");
  }

  void beginArray(const Attributes& attributes) {
    const auto number = [&](const char* name, std::int64_t otherwise) {
      const auto parsed =
          cli::parseWhole(attributes.find(name).value_or(std::to_string(otherwise)));
      return parsed && *parsed >= 0 ? std::uint64_t(*parsed) : 0;
    };
    header_.arrays.push_back({.name = attributes.get("Name"),
                              .type = attributes.get("type"),
                              .components = number("NumberOfComponents", 1),
                              .ofCells = ofCells_,
                              .format = attributes.get("format"),
                              .offset = number("offset", 0)});
    arrayDepth_ = depth_;
  }

  /// The rest of the file is no XML if the appended data is raw.
  void beginAppended(const Attributes& attributes) {
    header_.appendedAsBase64 = attributes.get("encoding") == "base64";
    header_.appended = place() + std::uint64_t(XML_GetCurrentByteCount(parser_.get()));
    XML_StopParser(parser_.get(), XML_FALSE);
  }

  ParserPointer parser_;
  VtiHeader header_;
  std::string fault_;
  int depth_ = 0, groupDepth_ = 0, arrayDepth_ = 0, pieces_ = 0;
  bool inGroup_ = false, ofCells_ = false;
};

/// The place behind the underscore that begins appended data.
std::uint64_t behindUnderscore(std::ifstream& file, std::uint64_t place) {
  file.clear();
  file.seekg(std::streamoff(place));
  for (char byte = 0; file.get(byte);) {
    ++place;
    if (byte == '_') return place;
    if (kBlank.find(byte) == std::string_view::npos) break;
  }
  throw BadInput("its appended data does not begin with an underscore");
}

VtiHeader readFrom(std::ifstream& file) {
  HeaderReader reader;
  std::string bytes(std::size_t{1} << 16, '\0');
  for (bool more = true; more;) {
    file.read(bytes.data(), std::streamsize(bytes.size()));
    const bool isLast = !file;
    more = reader.take(std::string_view(bytes).substr(0, std::size_t(file.gcount())), isLast) &&
           !isLast;
  }
  if (!reader.fault().empty()) throw BadInput(reader.fault());
  if (!reader.foundImage()) throw BadInput("it has no piece of image data");
  VtiHeader header = reader.takeHeader();
  if (header.appended != 0) header.appended = behindUnderscore(file, header.appended);
  return header;
}

}  // namespace

VtiHeader readVtiHeader(const std::filesystem::path& path) try {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw BadInput("it cannot be opened");
  return readFrom(file);
} catch (const BadInput& error) {
  throw BadInput("cannot read " + path.string() + ": " + error.what());
}

}  // namespace esvr::samples
