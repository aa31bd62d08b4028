#include "images/vti_data.h"

#include <charconv>
#include <string>
#include <utility>
#include <vector>

#include "esvr/error.h"
#include "images/byte_stream.h"
#include "images/element_type.h"

namespace esvr::samples {
namespace {

namespace fs = std::filesystem;

/// Numbers as text.
class AsciiData : public VtiData {
 public:
  AsciiData(std::unique_ptr<ByteStream> bytes, std::size_t component, std::size_t components)
      : bytes_(std::move(bytes)), component_(component), components_(components) {}

  void read(std::span<float> out) override {
    for (float& number : out)
      for (std::size_t i = 0; i < components_; ++i) {
        const std::string& word = nextWord();
        if (i == component_) number = numberOf(word);
      }
  }

 private:
  const std::string& nextWord() {
    constexpr std::size_t kMost = 400;  // more than a number of 64 bits can have
    const std::string blank = " \t\r\n";
    word_.clear();
    for (auto c = bytes_.next(); c; c = bytes_.next()) {
      const bool isBlank = blank.find(*c) != std::string::npos;
      if (isBlank && !word_.empty()) break;
      if (!isBlank) word_ += *c;
      if (word_.size() > kMost) throw BadInput("the data has a word that is no number");
    }
    if (word_.empty()) throw BadInput("the data ends too early");
    return word_;
  }

  static float numberOf(const std::string& word) {
    double number = 0.0;
    const char* const end = word.data() + word.size();
    const auto [at, error] = std::from_chars(word.data() + (word[0] == '+'), end, number);
    if (error != std::errc() || at != end) throw BadInput("'" + word + "' is not a number");
    return float(number);
  }

  BufferedBytes bytes_;
  std::size_t component_, components_;
  std::string word_;
};

/// A whole number before the data.
std::uint64_t readLength(ByteStream& bytes, const VtiHeader& header) {
  std::byte encoded[8] = {};
  readAll(bytes, std::span(encoded).first(header.lengthBytes));
  std::uint64_t number = 0;
  for (std::size_t i = 0; i < header.lengthBytes; ++i) {
    const std::size_t at = header.bigEndian ? i : header.lengthBytes - 1 - i;
    number = number << 8 | std::to_integer<std::uint64_t>(encoded[at]);
  }
  return number;
}

[[noreturn]] void refuseLength(std::uint64_t bytes) {
  throw BadInput("the length of the data is not that of the array, which has " +
                 std::to_string(bytes) + " bytes");
}

/// The lengths of blocks before compressed data.
/// \param most  number of bytes of the file, which has a length for each block
std::vector<ZlibBlocks::Block> readBlocks(ByteStream& bytes, const VtiHeader& header,
                                          std::uint64_t wanted, std::uint64_t most) {
  const std::uint64_t count = readLength(bytes, header), full = readLength(bytes, header),
                      partial = readLength(bytes, header), last = partial ? partial : full;
  if (count == 0 || count > most / header.lengthBytes || full == 0 || last > full ||
      double(count) * double(full) > 0x1p63 || (count - 1) * full + last != wanted)
    refuseLength(wanted);
  std::vector<ZlibBlocks::Block> blocks;
  for (std::uint64_t i = 0; i < count; ++i)
    blocks.push_back({i + 1 < count ? full : last, readLength(bytes, header)});
  return blocks;
}

/// Numbers as bytes.
class BinaryData : public VtiData {
 public:
  BinaryData(std::unique_ptr<ByteStream> encoded, const ElementType& type, EncodedValues form)
      : encoded_(std::move(encoded)), type_(type), form_(form) {}

  void begin(const VtiHeader& header, std::uint64_t wanted, std::uint64_t fileBytes) {
    if (header.compressed)
      blocks_ =
          std::make_unique<ZlibBlocks>(*encoded_, readBlocks(*encoded_, header, wanted, fileBytes));
    else if (readLength(*encoded_, header) != wanted)
      refuseLength(wanted);
  }

  void read(std::span<float> out) override {
    bytes_.resize(out.size() * form_.step * type_.bytes);
    readAll(blocks_ ? *blocks_ : *encoded_, bytes_);
    form_.bytes = bytes_;
    type_.decode(form_, out);
  }

 private:
  std::unique_ptr<ByteStream> encoded_, blocks_;
  const ElementType& type_;
  EncodedValues form_;
  std::vector<std::byte> bytes_;
};

std::unique_ptr<ByteStream> bytesOf(const fs::path& path, const VtiHeader& header,
                                    const VtiArray& array, std::uint64_t fileBytes) {
  const bool isAppended = array.format == "appended";
  if (isAppended && (header.appended == 0 || array.offset > fileBytes))
    throw BadInput("its appended data is missing");
  auto bytes = isAppended
                   ? std::make_unique<FileBytes>(path, header.appended + array.offset, fileBytes)
                   : std::make_unique<FileBytes>(path, array.begin, array.end);
  const bool isBase64 = isAppended ? header.appendedAsBase64 : array.format == "binary";
  if (!isBase64) return bytes;
  return std::make_unique<Base64Bytes>(std::move(bytes));
}

}  // namespace

std::string elementNameOf(const VtiArray& array) {
  for (const auto& [vtk, name] : {std::pair{"UInt8", "uint8"},
                                  {"Int8", "int8"},
                                  {"UInt16", "uint16"},
                                  {"Int16", "int16"},
                                  {"UInt32", "uint32"},
                                  {"Int32", "int32"},
                                  {"UInt64", "uint64"},
                                  {"Int64", "int64"},
                                  {"Float32", "float32"},
                                  {"Float64", "float64"}})
    if (array.type == vtk) return name;
  throw BadInput("array '" + array.name + "' is of type '" + array.type + "', which is no number");
}

std::unique_ptr<VtiData> openVtiData(const fs::path& path, const VtiHeader& header,
                                     const VtiArray& array, const VtiSelection& selection) {
  std::error_code error;
  const std::uint64_t fileBytes = fs::file_size(path, error);
  if (error) throw BadInput(error.message());
  const auto components = std::size_t(array.components);
  auto bytes = bytesOf(path, header, array, fileBytes);
  if (array.format == "ascii")
    return std::make_unique<AsciiData>(std::move(bytes), selection.component, components);
  if (array.format != "binary" && array.format != "appended")
    throw BadInput("array '" + array.name + "' has the format '" + array.format + "'");
  const std::string name = elementNameOf(array);
  const ElementType& type = elementType(name);
  auto data = std::make_unique<BinaryData>(std::move(bytes), type,
                                           EncodedValues{.bytes = {},
                                                         .bigEndian = header.bigEndian,
                                                         .first = selection.component,
                                                         .step = components});
  data->begin(header, selection.tuples * components * type.bytes, fileBytes);
  return data;
}

}  // namespace esvr::samples
