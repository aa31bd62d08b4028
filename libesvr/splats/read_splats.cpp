// Reads PLY files of splats: the header, which may list any elements and properties, the rows in ASCII or in binary
// of either byte order, and what a row says about a splat.

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <optional>
#include <string_view>

#include "core/geometry.h"
#include "core/parallel.h"
#include "core/parse_text.h"
#include "core/read_input.h"
#include "esvr/error.h"
#include "esvr/splats.h"
#include "splats/gaussian.h"

namespace esvr {
namespace {

using namespace splats;

// The header.

enum class Number { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat, kDouble };

struct NumberType {
  const char* name;
  const char* otherName;
  Number number;
  std::size_t bytes;
};
constexpr NumberType kTypes[] = {
    {"char", "int8", Number::kInt8, 1},      {"uchar", "uint8", Number::kUint8, 1},
    {"short", "int16", Number::kInt16, 2},   {"ushort", "uint16", Number::kUint16, 2},
    {"int", "int32", Number::kInt32, 4},     {"uint", "uint32", Number::kUint32, 4},
    {"float", "float32", Number::kFloat, 4}, {"double", "float64", Number::kDouble, 8}};

struct Property {
  std::string name;
  const NumberType* type = nullptr;
  const NumberType* lengthType = nullptr;  ///< of a list, whose items have `type`; else null
};

struct Element {
  std::string name;
  std::uint64_t count = 0;
  std::vector<Property> properties;
};

enum class Form { kAscii, kLittleEndian, kBigEndian };

struct PlyHeader {
  std::optional<Form> form;
  std::vector<Element> elements;
  std::vector<std::string> comments;
  std::size_t bytes = 0;  ///< where the rows begin
};

std::vector<std::string> wordsOf(std::string_view line) {
  constexpr std::string_view kSpaces = " \t";
  std::vector<std::string> words;
  for (std::size_t at = 0; (at = line.find_first_not_of(kSpaces, at)) != line.npos;) {
    const std::size_t end = std::min(line.find_first_of(kSpaces, at), line.size());
    words.emplace_back(line.substr(at, end - at));
    at = end;
  }
  return words;
}

class HeaderReader {
 public:
  HeaderReader(std::span<const std::byte> bytes, const std::string& file)
      : text_(reinterpret_cast<const char*>(bytes.data()), bytes.size()), file_(file) {}

  PlyHeader read() {
    if (nextLine() != "ply") fail("it is no PLY file");
    for (std::string_view line = nextLine(); line != "end_header"; line = nextLine()) take(line);
    if (!header_.form) fail("its header has no format");
    header_.bytes = at_;
    return std::move(header_);
  }

  [[noreturn]] void fail(const std::string& why) const { throw BadInput(file_ + ": " + why); }

 private:
  std::string_view nextLine() {
    constexpr std::size_t kLongest = 4096;
    const std::size_t end = text_.substr(at_, kLongest).find('\n');
    if (end == text_.npos) fail(at_ == 0 ? "it is no PLY file" : "its header has no end");
    std::string_view line = text_.substr(at_, end);
    at_ += end + 1;
    if (line.ends_with('\r')) line.remove_suffix(1);
    return line;
  }

  void take(std::string_view line) {
    constexpr std::size_t kMostComments = 1000;
    const auto words = wordsOf(line);
    if (words.empty()) return;
    if (words[0] == "comment" || words[0] == "obj_info") {
      if (header_.comments.size() < kMostComments) header_.comments.emplace_back(line);
    } else if (words[0] == "format" && words.size() == 3) {
      takeFormat(words);
    } else if (words[0] == "element" && words.size() == 3) {
      takeElement(words);
    } else if (words[0] == "property" && words.size() >= 3) {
      takeProperty(words);
    } else {
      fail("its header has the line '" + shownText(line, LineEnds::kReplace) + "'");
    }
  }

  void takeFormat(const std::vector<std::string>& words) {
    if (words[2] != "1.0")
      fail("its format has version " + shownText(words[2], LineEnds::kReplace) + ", not 1.0");
    if (words[1] == "ascii")
      header_.form = Form::kAscii;
    else if (words[1] == "binary_little_endian")
      header_.form = Form::kLittleEndian;
    else if (words[1] == "binary_big_endian")
      header_.form = Form::kBigEndian;
    else
      fail("its format '" + shownText(words[1], LineEnds::kReplace) + "' is unknown");
  }

  void takeElement(const std::vector<std::string>& words) {
    const auto count = parseWhole(words[2]);
    if (!count || *count < 0)
      fail("its element " + shownText(words[1], LineEnds::kReplace) + " has the number '" +
           shownText(words[2], LineEnds::kReplace) + "'");
    for (const Element& other : header_.elements)
      if (other.name == words[1])
        fail("its element " + shownText(words[1], LineEnds::kReplace) + " is there twice");
    header_.elements.push_back({words[1], std::uint64_t(*count), {}});
  }

  void takeProperty(const std::vector<std::string>& words) {
    if (header_.elements.empty()) fail("its header has a property before the first element");
    const bool isList = words[1] == "list" && words.size() == 5;
    if (!isList && words.size() != 3)
      fail("its header has a property that is neither a number nor a list");
    Property property{.name = words.back(), .type = typeOf(words[isList ? 3 : 1])};
    if (isList) property.lengthType = typeOf(words[2]);
    header_.elements.back().properties.push_back(std::move(property));
  }

  const NumberType* typeOf(const std::string& word) const {
    for (const NumberType& type : kTypes)
      if (word == type.name || word == type.otherName) return &type;
    fail("its header has the unknown type '" + shownText(word, LineEnds::kReplace) + "'");
  }

  std::string_view text_;
  const std::string& file_;
  std::size_t at_ = 0;
  PlyHeader header_;
};

// Rows.

/// The numbers of the rows, one after the other.
class Numbers {
 public:
  virtual ~Numbers() = default;
  [[nodiscard]] virtual double next(const NumberType& type) = 0;
  /// Passes over numbers of a type.
  virtual void skip(const NumberType& type, std::uint64_t count) = 0;
  /// True if so many rows of at least so many numbers and bytes each may follow.
  [[nodiscard]] virtual bool mayHave(std::uint64_t rows, std::uint64_t numbers,
                                     std::uint64_t bytes) const = 0;
};

/// Thrown by Numbers at the end of the bytes, or at a word that is no number.
struct NoNumber {
  std::string why;
};

class BinaryNumbers : public Numbers {
 public:
  BinaryNumbers(std::span<const std::byte> rows, bool isBigEndian)
      : rows_(rows), swaps_(isBigEndian) {}

  double next(const NumberType& type) override {
    std::array<std::byte, 8> bytes{};
    if (rows_.size() < type.bytes) throw NoNumber{"it ends too early"};
    std::copy_n(rows_.begin(), type.bytes, bytes.begin());
    rows_ = rows_.subspan(type.bytes);
    if (swaps_) std::reverse(bytes.begin(), bytes.begin() + std::ptrdiff_t(type.bytes));
    switch (type.number) {
      case Number::kInt8:
        return as<std::int8_t>(bytes);
      case Number::kUint8:
        return as<std::uint8_t>(bytes);
      case Number::kInt16:
        return as<std::int16_t>(bytes);
      case Number::kUint16:
        return as<std::uint16_t>(bytes);
      case Number::kInt32:
        return as<std::int32_t>(bytes);
      case Number::kUint32:
        return as<std::uint32_t>(bytes);
      case Number::kFloat:
        return double(as<float>(bytes));
      case Number::kDouble:
        return as<double>(bytes);
    }
    return 0.0;
  }
  void skip(const NumberType& type, std::uint64_t count) override {
    if (count > rows_.size() / type.bytes) throw NoNumber{"it ends too early"};
    rows_ = rows_.subspan(std::size_t(count) * type.bytes);
  }
  bool mayHave(std::uint64_t rows, std::uint64_t, std::uint64_t bytes) const override {
    return bytes == 0 || rows <= rows_.size() / bytes;
  }

 private:
  template <class T>
  static T as(const std::array<std::byte, 8>& bytes) {
    T value;
    std::memcpy(&value, bytes.data(), sizeof(T));
    return value;
  }

  std::span<const std::byte> rows_;
  bool swaps_;
};

class TextNumbers : public Numbers {
 public:
  explicit TextNumbers(std::span<const std::byte> rows)
      : text_(reinterpret_cast<const char*>(rows.data()), rows.size()) {}

  double next(const NumberType&) override {
    constexpr std::string_view kSpaces = " \t\r\n";
    text_.remove_prefix(std::min(text_.find_first_not_of(kSpaces), text_.size()));
    if (text_.starts_with('+')) text_.remove_prefix(1);
    double value = 0.0;
    const auto [end, error] = std::from_chars(text_.data(), text_.data() + text_.size(), value);
    if (error == std::errc::result_out_of_range)
      value = std::numeric_limits<double>::infinity();
    else if (error != std::errc{})
      throw NoNumber{text_.empty() ? "it ends too early" : "a word of it is no number"};
    text_.remove_prefix(std::size_t(end - text_.data()));
    if (!text_.empty() && kSpaces.find(text_.front()) == kSpaces.npos)
      throw NoNumber{"a word of it is no number"};
    return value;
  }
  void skip(const NumberType& type, std::uint64_t count) override {
    for (; count > 0; --count) (void)next(type);
  }
  bool mayHave(std::uint64_t rows, std::uint64_t numbers, std::uint64_t) const override {
    return numbers == 0 || rows <= (text_.size() / 2 + 1) / numbers;  // a digit and a space each
  }

 private:
  std::string_view text_;
};

// Splats.

/// The numbers of a splat, by their places in a row of this file's order.
enum Slot {
  kX,
  kY,
  kZ,
  kOpacity,
  kScale0,
  kScale1,
  kScale2,
  kRot0,
  kRot1,
  kRot2,
  kRot3,
  kRed,
  kGreen,
  kBlue,
  kSlots
};
constexpr const char* kSlotNames[kSlots] = {"x",       "y",       "z",      "opacity", "scale_0",
                                            "scale_1", "scale_2", "rot_0",  "rot_1",   "rot_2",
                                            "rot_3",   "f_dc_0",  "f_dc_1", "f_dc_2"};
constexpr std::size_t kNoSlot = kSlots;
using SplatRow = std::array<double, kSlots>;

class SplatReader {
 public:
  SplatReader(std::span<const std::byte> bytes, const std::string& file,
              const SplatReadOptions& options)
      : file_(file), options_(options), header_(HeaderReader(bytes, file).read()) {
    const auto rows = bytes.subspan(header_.bytes);
    if (header_.form == Form::kAscii)
      numbers_ = std::make_unique<TextNumbers>(rows);
    else
      numbers_ = std::make_unique<BinaryNumbers>(rows, header_.form == Form::kBigEndian);
  }

  SplatFile read() {
    readPlacement();
    for (const Element& element : header_.elements) {
      requireRows(element);
      if (element.name == "vertex") {
        readVertices(element);
        return std::move(result_);
      }
      readRows(
          element, [](std::size_t, double) {}, [] {});
    }
    fail("it has no element 'vertex'");
  }

 private:
  [[noreturn]] void fail(const std::string& why) const { throw BadInput(file_ + ": " + why); }

  void requireRows(const Element& element) const {
    std::uint64_t bytes = 0;
    for (const Property& property : element.properties)
      bytes += (property.lengthType ? property.lengthType : property.type)->bytes;
    if (!numbers_->mayHave(element.count, element.properties.size(), bytes))
      fail("it is too short for the " + std::to_string(element.count) + " rows of its element " +
           shownText(element.name, LineEnds::kReplace));
  }

  /// Calls take(p, value) for the numbers of property p, and endRow() after each row.
  template <class Take, class EndRow>
  void readRows(const Element& element, const Take& take, const EndRow& endRow) try {
    constexpr std::uint64_t kRowsBetweenChecks = 4096;
    if (element.properties.empty()) return;
    for (std::uint64_t row = 0; row < element.count; ++row) {
      if (row % kRowsBetweenChecks == 0) throwIfCancelled();
      for (std::size_t p = 0; p < element.properties.size(); ++p)
        readProperty(element.properties[p], p, take);
      endRow();
    }
  } catch (const NoNumber& error) {
    fail(error.why + ", in the rows of its element " + shownText(element.name, LineEnds::kReplace));
  }

  template <class Take>
  void readProperty(const Property& property, std::size_t p, const Take& take) {
    if (!property.lengthType) return take(p, numbers_->next(*property.type));
    const double length = numbers_->next(*property.lengthType);
    if (!(length >= 0.0 && length <= double(std::numeric_limits<std::uint32_t>::max())))
      throw NoNumber{"a list has an impossible length"};
    numbers_->skip(*property.type, std::uint64_t(length));
  }

  /// The slot of each property. \throws BadInput  one that is needed is missing or there twice
  std::vector<std::size_t> slotsOf(const Element& vertex) {
    std::vector<std::size_t> slots(vertex.properties.size(), kNoSlot);
    std::array<int, kSlots> times{};
    for (std::size_t p = 0; p < slots.size(); ++p) {
      const Property& property = vertex.properties[p];
      result_.hasHigherDegrees |= property.name.starts_with("f_rest_");
      if (property.name == "packed_position")
        fail("it is a compressed PLY file of splats; convert it to an ordinary one first");
      const auto slot =
          std::size_t(std::find(kSlotNames, kSlotNames + kSlots, property.name) - kSlotNames);
      if (slot == kNoSlot || property.lengthType) continue;
      slots[p] = slot;
      if (++times[slot] > 1) fail("its property " + property.name + " is there twice");
    }
    for (std::size_t slot = 0; slot < kRed; ++slot)
      if (times[slot] == 0)
        fail(std::string("it has no property ") + kSlotNames[slot] +
             ", so it is no file of splats");
    const int colors = times[kRed] + times[kGreen] + times[kBlue];
    if (colors != 0 && colors != 3) fail("it has some of f_dc_0, f_dc_1 and f_dc_2 only");
    hasColors_ = colors == 3;
    return slots;
  }

  void readVertices(const Element& vertex) {
    constexpr double kBytesPerSplat = 2.0 * 14 * sizeof(float);  // arrays that grow have a copy
    const auto slots = slotsOf(vertex);
    requireWithinMemory(double(vertex.count) * kBytesPerSplat, options_.maxBytes, file_);
    result_.inFile = vertex.count;
    SplatRow row{};
    readRows(
        vertex,
        [&](std::size_t p, double value) {
          if (slots[p] != kNoSlot) row[slots[p]] = value;
        },
        [&] { add(row); });
    if (result_.scene.splats.size() == 0)
      fail(vertex.count > 0 ? "none of its splats can be used: " + result_.whyDropped()
                            : "it has no splats");
  }

  void add(SplatRow row) {
    // A standard deviation of 0 and an alpha of 1 have infinite logarithms.
    const double largest = std::max({row[kScale0], row[kScale1], row[kScale2]});
    const double flattest = largest - std::log(kMostFlat);
    bool isRounded = false;
    for (std::size_t s = kScale0; s <= kScale2; ++s)
      if (row[s] < flattest) row[s] = flattest, isRounded = true;
    const double alpha = 1.0 / (1.0 + std::exp(-row[kOpacity]));
    const Quaternion q{row[kRot0], row[kRot1], row[kRot2], row[kRot3]};
    const double length = lengthOf(q);
    if (const auto fault = faultOf(row, largest, length, alpha)) {
      ++result_.faulty[std::size_t(*fault)];
      return;
    }
    result_.rounded += isRounded;
    Splats& splats = result_.scene.splats;
    for (std::size_t a = 0; a < 3; ++a) {
      splats.center[a].push_back(float(row[kX + a]));
      splats.logScale[a].push_back(float(row[kScale0 + a]));
      if (hasColors_)
        splats.color[a].push_back(float(kMiddleColor + kFirstHarmonic * row[kRed + a]));
    }
    const double sign = q[0] < 0.0 ? -1.0 : 1.0;
    for (std::size_t a = 0; a < 4; ++a) splats.rotation[a].push_back(float(sign * q[a] / length));
    splats.alpha.push_back(float(alpha));
  }

  /// \param largest  the logarithm of the largest size, which is infinite for sizes of 0
  static std::optional<SplatFault> faultOf(const SplatRow& row, double largest, double length,
                                           double alpha) {
    for (std::size_t s = 0; s < kSlots; ++s) {
      const bool isScale = s >= kScale0 && s <= kScale2;
      const double v = row[s];
      if (std::isnan(v) || (s != kOpacity && !isScale && !std::isfinite(float(v))))
        return SplatFault::kNotFinite;
    }
    if (largest < -double(kMaxLogScale)) return SplatFault::kTooSmall;
    if (largest > double(kMaxLogScale)) return SplatFault::kTooLarge;
    if (!(length > 0.0)) return SplatFault::kNoRotation;
    if (!(float(alpha) > 0.0f)) return SplatFault::kUnseen;
    return std::nullopt;
  }

  // Our comments.

  void readPlacement() {
    SplatScene& scene = result_.scene;
    for (const std::string& comment : header_.comments) {
      const auto words = wordsOf(comment);
      if (words.size() < 2) continue;
      if (words[1] == kMatrixWord) {
        scene.toWorld = matrixOf(words, kMatrixWord, faultOfToWorld);
        result_.hasPlacement = true;
      }
      if (words[1] == kLatticeWord)
        scene.indexToWorld = matrixOf(words, kLatticeWord, faultOfLattice);
      if (words[1] == kUpWord) scene.up = words.back() == "z" ? UpAxis::kZ : UpAxis::kY;
      if (words[1] == kDensityWord) scene.densityScale = readDensityScale(words);
      if (words[1] == kGridWord && words.size() > 2)
        scene.name = comment.substr(comment.find(kGridWord) + std::strlen(kGridWord) + 1);
    }
    if (result_.hasPlacement) return;
    scene.indexToWorld.reset();
    scene.up = options_.up.value_or(UpAxis::kY);
    if (!options_.up) return;
    if (options_.up == UpAxis::kY)
      scene.toWorld = {1, 0, 0, 0, 0, -1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1};
    else
      scene.toWorld = {1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1};
  }

  template <class Fault>
  std::array<double, 16> matrixOf(const std::vector<std::string>& words, const char* word,
                                  const Fault& faultOfIt) const {
    constexpr std::size_t kFirst = 2, kEntries = 16;
    const std::string start = std::string("its comment ") + word + ' ';
    std::array<double, kEntries> matrix{};
    if (words.size() != kFirst + kEntries) fail(start + "has no 16 numbers");
    for (std::size_t i = 0; i < kEntries; ++i) {
      const auto number = parseNumber(words[kFirst + i]);
      if (!number) fail(start + "has no 16 numbers");
      matrix[i] = *number;
    }
    if (const std::string fault = faultOfIt(matrix); !fault.empty()) fail(start + fault);
    return matrix;
  }

  double readDensityScale(const std::vector<std::string>& words) const {
    const auto number = parseNumber(words.back());
    if (!number || !isUsualScale(*number))
      fail(std::string("its comment ") + kDensityWord + " has no usual number above 0");
    return *number;
  }

  const std::string& file_;
  const SplatReadOptions& options_;
  PlyHeader header_;
  std::unique_ptr<Numbers> numbers_;
  bool hasColors_ = false;
  SplatFile result_;
};

using Affine = std::array<double, 16>;

double rowsDot(const Affine& m, std::size_t i, std::size_t j) {
  return m[4 * i] * m[4 * j] + m[4 * i + 1] * m[4 * j + 1] + m[4 * i + 2] * m[4 * j + 2];
}

double determinantOf(const Affine& m) {
  return m[0] * (m[5] * m[10] - m[6] * m[9]) - m[1] * (m[4] * m[10] - m[6] * m[8]) +
         m[2] * (m[4] * m[9] - m[5] * m[8]);
}

bool isTooLarge(const Affine& m) {
  return !std::ranges::all_of(m, [](double entry) { return std::abs(entry) < kMostNumber; });
}

bool hasLastColumn(const Affine& m) {
  return m[3] == 0.0 && m[7] == 0.0 && m[11] == 0.0 && m[15] == 1.0;
}

}  // namespace

std::string splats::faultOfToWorld(const Affine& m) {
  constexpr double kTolerance = 1e-6;
  if (isTooLarge(m)) return "is too large";
  const double square = rowsDot(m, 0, 0);
  if (square > 0.0 && !(square > kLeastNumber * kLeastNumber)) return "is too small";
  bool isOne = hasLastColumn(m) && square > 0.0 && square < kMostNumber * kMostNumber;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j)
      isOne = isOne && std::abs(rowsDot(m, i, j) - (i == j ? square : 0.0)) <= kTolerance * square;
  return isOne && determinantOf(m) > 0.0 ? "" : "has no rotation with a scale and a shift";
}

std::string splats::faultOfLattice(const Affine& m) {
  constexpr double kFlattest =
      1e-9;  // share that a voxel has of the volume of a box with its edges
  constexpr double kSmallest = 1e-14;  // volume of a voxel; OpenVDB has no transforms below 3e-15
  if (isTooLarge(m)) return "is too large";
  double edges = 1.0;
  for (std::size_t i = 0; i < 3; ++i) edges *= std::sqrt(rowsDot(m, i, i));
  const double volume = std::abs(determinantOf(m));
  if (!hasLastColumn(m) || !(volume > kFlattest * edges)) return "is no transform of voxels";
  return volume > kSmallest ? "" : "has voxels that are too small";
}

std::uint64_t SplatFile::dropped() const {
  std::uint64_t all = 0;
  for (const std::uint64_t n : faulty) all += n;
  return all;
}

std::string SplatFile::whyDropped() const {
  constexpr const char* kTexts[kSplatFaults] = {
      "with a number that is not finite", "with a quaternion of 0",
      "with a size of 0 or below e^-32", "with a size above e^32", "with an opacity of 0"};
  std::string text;
  for (std::size_t f = 0; f < kSplatFaults; ++f)
    if (faulty[f] > 0)
      text += (text.empty() ? "" : ", ") + std::to_string(faulty[f]) + ' ' + kTexts[f];
  return text;
}

SplatFile parseSplats(std::span<const std::byte> bytes, const std::string& nameForErrors,
                      const SplatReadOptions& options) {
  return SplatReader(bytes, nameForErrors, options).read();
}

SplatFile readSplats(const std::filesystem::path& path, const SplatReadOptions& options) {
  constexpr std::size_t kPiece = std::size_t{1} << 20;
  InputStream stream(path);
  std::vector<std::byte> bytes(kPiece);
  std::size_t got = 0;
  while (const std::size_t n = stream.read(std::span(bytes).subspan(got))) {
    throwIfCancelled();
    got += n;
    if (got < bytes.size()) continue;
    requireWithinMemory(2.0 * double(bytes.size()), options.maxBytes, path.string());
    bytes.resize(2 * bytes.size());
  }
  return parseSplats(std::span(bytes).first(got), path.string(), options);
}

}  // namespace esvr
