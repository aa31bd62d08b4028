#include "decoder/zstd.h"

#include <array>
#include <vector>

#include "decoder/zstd_tables.h"
#include "esvr/error.h"

namespace esvr::decoder {
namespace {

constexpr std::uint32_t kMagic = 0xFD2FB528u;
constexpr std::size_t kMaxBlock = std::size_t{1} << 17;  ///< bytes of content

/// Codes of lengths: the smallest length of each code, and the bits that are added to it.
struct LengthCode {
  std::uint32_t base;
  std::uint8_t bits;
};
// RFC 8878, section 3.1.1.3.2.1.1.
constexpr std::array<LengthCode, 36> kLiteralLengths{
    {{0, 0},     {1, 0},      {2, 0},      {3, 0},     {4, 0},   {5, 0},     {6, 0},     {7, 0},
     {8, 0},     {9, 0},      {10, 0},     {11, 0},    {12, 0},  {13, 0},    {14, 0},    {15, 0},
     {16, 1},    {18, 1},     {20, 1},     {22, 1},    {24, 2},  {28, 2},    {32, 3},    {40, 3},
     {48, 4},    {64, 6},     {128, 7},    {256, 8},   {512, 9}, {1024, 10}, {2048, 11}, {4096, 12},
     {8192, 13}, {16384, 14}, {32768, 15}, {65536, 16}}};
constexpr std::size_t kPlainMatches = 32;  ///< codes of matches of 3, 4, ... bytes
constexpr std::array<LengthCode, 21> kLongMatches{
    {{35, 1},    {37, 1},    {39, 1},    {41, 1},    {43, 2},     {47, 2},     {51, 3},
     {59, 3},    {67, 4},    {83, 4},    {99, 5},    {131, 7},    {259, 8},    {515, 9},
     {1027, 10}, {2051, 11}, {4099, 12}, {8195, 13}, {16387, 14}, {32771, 15}, {65539, 16}}};

LengthCode matchCode(std::uint8_t code) {
  if (code < kPlainMatches) return {std::uint32_t(code) + 3, 0};
  require(code - kPlainMatches < kLongMatches.size(), "an unknown length of a match");
  return kLongMatches[code - kPlainMatches];
}
LengthCode literalCode(std::uint8_t code) {
  require(code < kLiteralLengths.size(), "an unknown length of literals");
  return kLiteralLengths[code];
}

// RFC 8878, section 3.1.1.3.2.2.
constexpr std::int16_t kLiteralShares[] = {4, 3, 2, 2, 2, 2, 2, 2, 2,  2,  2,  2,
                                           2, 1, 1, 1, 2, 2, 2, 2, 2,  2,  2,  2,
                                           2, 3, 2, 1, 1, 1, 1, 1, -1, -1, -1, -1};
constexpr std::int16_t kMatchShares[] = {1, 4, 3, 2, 2, 2, 2, 2, 2, 1, 1,  1,  1,  1,  1,  1,  1, 1,
                                         1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1,  1,  1,  1,  1,  1,  1, 1,
                                         1, 1, 1, 1, 1, 1, 1, 1, 1, 1, -1, -1, -1, -1, -1, -1, -1};
constexpr std::int16_t kOffsetShares[] = {1, 1, 1, 1, 1, 1, 2, 2, 2, 1,  1,  1,  1,  1, 1,
                                          1, 1, 1, 1, 1, 1, 1, 1, 1, -1, -1, -1, -1, -1};

/// One of the three codes of sequences: its usual table and limits.
struct CodeKind {
  std::span<const std::int16_t> usual;
  int usualLog;
  FseTable::Limits limits;
};
constexpr CodeKind kLiteralKind{kLiteralShares, 6, {9, 36}}, kOffsetKind{kOffsetShares, 5, {8, 32}},
    kMatchKind{kMatchShares, 6, {9, 53}};

enum TableMode : std::uint32_t { kUsual, kOneSymbol, kDescribed, kRepeated };
enum LiteralsKind : std::uint32_t { kRawLiterals, kRepeatedByte, kWithTree, kWithLastTree };
enum BlockKind : std::uint32_t { kRawBlock, kRepeatedBlock, kCompressedBlock };

/// A frame while it is decoded; tables and offsets pass from one block to the next.
class Frame {
 public:
  Frame(std::span<const std::byte> bytes, std::span<std::byte> to) : in_(bytes), to_(to) {}

  void decode() {
    const bool hasChecksum = readHeader();
    while (!readBlock()) continue;
    require(written_ == to_.size(), "its content is too short");
    if (hasChecksum) (void)in_.take(4);
    require(in_.empty(), "there is something behind it");
  }

 private:
  bool readHeader() {
    require(in_.number(4) == kMagic, "it is no Zstandard frame");
    const std::uint32_t flags = in_.byte();
    const bool single = flags & 0x20;
    require((flags & 0x0B) == 0, "it needs a dictionary");
    if (!single) (void)in_.byte();  // the window, which never exceeds the content
    constexpr std::size_t kSizeBytes[] = {0, 2, 4, 8};
    const std::uint32_t kind = flags >> 6;
    (void)in_.take(kind == 0 && single ? 1 : kSizeBytes[kind]);  // the size is known
    return flags & 0x04;
  }

  /// \return whether it was the last block
  bool readBlock() {
    const auto head = std::uint32_t(in_.number(3));
    const std::size_t size = head >> 3;
    switch (head >> 1 & 3) {
      case kRawBlock:
        append(in_.take(size));
        break;
      case kRepeatedBlock:
        fill(in_.take(1).front(), size);
        break;
      case kCompressedBlock:
        readCompressed(Bytes(in_.take(size)));
        break;
      default:
        require(false, "a block of an unknown kind");
    }
    return head & 1;
  }

  void append(std::span<const std::byte> bytes) {
    require(bytes.size() <= to_.size() - written_, "its content is too long");
    std::copy(bytes.begin(), bytes.end(), to_.begin() + std::ptrdiff_t(written_));
    written_ += bytes.size();
  }
  void fill(std::byte value, std::size_t count) {
    require(count <= to_.size() - written_, "its content is too long");
    std::fill_n(to_.begin() + std::ptrdiff_t(written_), count, value);
    written_ += count;
  }
  /// Appends a copy of what lies `offset` bytes before the end; the two may overlap.
  void match(std::size_t offset, std::size_t length) {
    require(offset > 0 && offset <= written_, "a match begins before the content");
    require(length <= to_.size() - written_, "its content is too long");
    for (std::size_t i = 0; i < length; ++i, ++written_) to_[written_] = to_[written_ - offset];
  }

  void readCompressed(Bytes in) {
    readLiterals(in);
    std::span<const std::byte> literals(literals_);
    if (const std::size_t count = readCount(in); count > 0) readSequences(in, count, literals);
    append(literals);
  }

  void readLiterals(Bytes& in) {
    const auto first = std::to_integer<std::uint32_t>(Bytes(in).take(1).front());
    const std::uint32_t kind = first & 3, format = first >> 2 & 3;
    if (kind == kRawLiterals || kind == kRepeatedByte) return readPlainLiterals(in, kind, format);
    struct Form {
      std::size_t headBytes;
      int bits;
    };
    constexpr Form kForms[] = {{3, 10}, {3, 10}, {4, 14}, {5, 18}};
    const Form form = kForms[format];
    const std::uint64_t head = in.number(form.headBytes) >> 4,
                        mask = (std::uint64_t{1} << form.bits) - 1;
    resizeLiterals(head & mask);
    Bytes coded(in.take(head >> form.bits & mask));
    if (kind == kWithTree) tree_ = HuffmanTable::read(coded);
    require(!tree_.empty(), "there is no Huffman table");
    if (format == 0) return tree_.decode(coded.rest(), literals_);
    readFourStreams(coded);
  }
  void readPlainLiterals(Bytes& in, std::uint32_t kind, std::uint32_t format) {
    constexpr std::size_t kHeadBytes[] = {1, 2, 1, 3};
    const std::uint64_t head = in.number(kHeadBytes[format]);
    resizeLiterals(format == 1 || format == 3 ? head >> 4 : head >> 3);
    if (kind == kRepeatedByte)
      std::ranges::fill(literals_, in.take(1).front());
    else
      std::ranges::copy(in.take(literals_.size()), literals_.begin());
  }
  void resizeLiterals(std::uint64_t size) {
    require(size <= kMaxBlock, "there are too many literals");
    literals_.resize(size);
  }
  void readFourStreams(Bytes& coded) {
    std::array<std::size_t, 3> sizes{};
    for (std::size_t& size : sizes) size = coded.number(2);
    const std::size_t share = (literals_.size() + 3) / 4;
    require(3 * share <= literals_.size(), "there are too few literals");
    std::span<std::byte> to(literals_);
    for (const std::size_t size : sizes) {
      tree_.decode(coded.take(size), to.first(share));
      to = to.subspan(share);
    }
    tree_.decode(coded.rest(), to);
  }

  static std::size_t readCount(Bytes& in) {
    constexpr std::uint32_t kTwoBytes = 128, kThreeBytes = 255, kBase = 0x7F00;
    const std::uint32_t first = in.byte();
    if (first < kTwoBytes) return first;
    if (first < kThreeBytes) return ((first - kTwoBytes) << 8) + in.byte();
    return in.number(2) + kBase;
  }

  static void readTable(Bytes& in, std::uint32_t mode, const CodeKind& kind, FseTable& table) {
    switch (mode & 3) {
      case kUsual:
        table = FseTable(kind.usual, kind.usualLog);
        break;
      case kOneSymbol:
        table = FseTable(std::uint8_t(in.byte()));
        break;
      case kDescribed:
        table = FseTable::read(in, kind.limits);
        break;
      default:
        require(!table.empty(), "there is no table to repeat");
    }
  }

  void readSequences(Bytes& in, std::size_t count, std::span<const std::byte>& literals) {
    const std::uint32_t modes = in.byte();
    readTable(in, modes >> 6, kLiteralKind, literalTable_);
    readTable(in, modes >> 4, kOffsetKind, offsetTable_);
    readTable(in, modes >> 2, kMatchKind, matchTable_);
    BackwardBits bits(in.rest());
    FseTable::State literal(literalTable_, bits), offset(offsetTable_, bits),
        length(matchTable_, bits);
    for (std::size_t i = 0; i < count; ++i) {
      if (i > 0) literal.advance(bits), length.advance(bits), offset.advance(bits);
      const Sequence s = readSequence(bits, literal.symbol(), offset.symbol(), length.symbol());
      require(bits.left() >= 0, "the sequences end too early");
      require(s.literals <= literals.size(), "there are too few literals");
      append(literals.first(s.literals));
      literals = literals.subspan(s.literals);
      match(nextOffset(s), s.match);
    }
    require(bits.left() == 0, "there is something behind the sequences");
  }

  struct Sequence {
    std::size_t literals, match;
    std::uint64_t offset;  ///< the offset in its coded form
  };
  static Sequence readSequence(BackwardBits& bits, std::uint8_t literal, std::uint8_t offset,
                               std::uint8_t length) {
    constexpr std::uint8_t kMaxOffsetBits = 31;
    require(offset <= kMaxOffsetBits, "an unknown offset");
    const LengthCode match = matchCode(length), literals = literalCode(literal);
    Sequence s{};
    s.offset = (std::uint64_t{1} << offset) + bits.read(offset);
    s.match = match.base + bits.read(match.bits);
    s.literals = literals.base + bits.read(literals.bits);
    return s;
  }

  /// The offset of a sequence, which may be one of the last three (RFC 8878, section 3.1.1.5).
  std::uint64_t nextOffset(const Sequence& s) {
    constexpr std::uint64_t kRecent = 3;
    const std::uint64_t place = s.offset - 1 + (s.literals == 0 ? 1 : 0);
    const bool recent = s.offset <= kRecent;
    const std::uint64_t offset = !recent           ? s.offset - kRecent
                                 : place < kRecent ? recent_[place]
                                                   : recent_[0] - 1;
    if (recent && place == 0) return offset;
    if (!recent || place > 1) recent_[2] = recent_[1];
    recent_[1] = recent_[0];
    return recent_[0] = offset;
  }

  Bytes in_;
  std::span<std::byte> to_;
  std::size_t written_ = 0;
  std::vector<std::byte> literals_;
  HuffmanTable tree_;
  FseTable literalTable_, offsetTable_, matchTable_;
  std::array<std::uint64_t, 3> recent_{1, 4, 8};
};

}  // namespace

void decompressZstd(std::span<const std::byte> frame, std::span<std::byte> to,
                    const std::string& where) try {
  Frame(frame, to).decode();
} catch (const BadFrame& fault) {
  throw BadInput(where + ": damaged Zstandard frame: " + fault.what());
}

}  // namespace esvr::decoder
