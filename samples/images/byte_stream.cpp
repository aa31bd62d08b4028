#include "images/byte_stream.h"

#include <zlib.h>

#include <algorithm>
#include <string>
#include <utility>

#include "esvr/error.h"

namespace esvr::samples {
namespace {

/// The number of a base64 character; nothing for others.
std::optional<unsigned> base64Digit(char c) {
  if (c >= 'A' && c <= 'Z') return unsigned(c - 'A');
  if (c >= 'a' && c <= 'z') return unsigned(c - 'a') + 26;
  if (c >= '0' && c <= '9') return unsigned(c - '0') + 52;
  if (c == '+') return 62;
  if (c == '/') return 63;
  return std::nullopt;
}

bool isBlank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; }

[[noreturn]] void refuseBlock() { throw BadInput("a compressed block is damaged"); }
[[noreturn]] void refuseEnd() { throw BadInput("the data ends too early"); }

}  // namespace

void readAll(ByteStream& stream, std::span<std::byte> out) {
  if (stream.read(out) != out.size()) refuseEnd();
}

FileBytes::FileBytes(const std::filesystem::path& path, std::uint64_t begin, std::uint64_t end)
    : file_(path, std::ios::binary), left_(end > begin ? end - begin : 0) {
  file_.seekg(std::streamoff(begin));
}

std::size_t FileBytes::read(std::span<std::byte> out) {
  const auto wanted = std::min<std::uint64_t>(out.size(), left_);
  file_.read(reinterpret_cast<char*>(out.data()), std::streamsize(wanted));
  const auto count = std::size_t(file_.gcount());
  left_ = file_ ? left_ - count : 0;
  return count;
}

std::optional<char> BufferedBytes::next() {
  if (at_ == filled_) {
    filled_ = from_->read(buffer_);
    at_ = 0;
    if (filled_ == 0) return std::nullopt;
  }
  return std::to_integer<char>(buffer_[at_++]);
}

bool Base64Bytes::decodeGroup() {
  constexpr std::size_t kDigits = 4;
  unsigned bits = 0;
  std::size_t digits = 0, padding = 0;
  while (digits + padding < kDigits) {
    const auto c = from_.next();
    if (!c) break;
    if (isBlank(*c)) continue;
    const auto digit = base64Digit(*c);
    if (*c != '=' && (!digit || padding > 0))
      throw BadInput("the data has a character that base64 does not have there");
    bits = bits * 64 + digit.value_or(0);
    ++(digit ? digits : padding);
  }
  if (digits + padding == 0) return false;
  if (digits + padding < kDigits || digits < 2) refuseEnd();
  for (std::size_t i = 0; i < 3; ++i) group_[i] = std::byte((bits >> (16 - 8 * i)) & 0xff);
  at_ = 0;
  decoded_ = digits - 1;
  return true;
}

std::size_t Base64Bytes::read(std::span<std::byte> out) {
  for (std::size_t i = 0; i < out.size(); ++i) {
    if (at_ == decoded_ && !decodeGroup()) return i;
    out[i] = group_[at_++];
  }
  return out.size();
}

struct ZlibBlocks::State {
  State() {
    if (inflateInit(&stream) != Z_OK) throw MemoryExceeded("there is no memory for zlib");
  }
  ~State() { inflateEnd(&stream); }
  State(const State&) = delete;
  State& operator=(const State&) = delete;

  z_stream stream{};
  std::vector<std::byte> input = std::vector<std::byte>(std::size_t{1} << 16);
};

ZlibBlocks::ZlibBlocks(ByteStream& from, std::vector<Block> blocks)
    : from_(from), blocks_(std::move(blocks)), state_(std::make_unique<State>()) {}

ZlibBlocks::~ZlibBlocks() = default;

void ZlibBlocks::beginBlock() {
  left_ = blocks_[next_].bytes;
  compressedLeft_ = blocks_[next_].compressedBytes;
  ++next_;
  ended_ = false;
  inflateReset(&state_->stream);
  state_->stream.avail_in = 0;
}

void ZlibBlocks::refill() {
  z_stream& stream = state_->stream;
  if (stream.avail_in > 0 || compressedLeft_ == 0) return;
  const auto count = std::min<std::uint64_t>(compressedLeft_, state_->input.size());
  readAll(from_, std::span(state_->input).first(std::size_t(count)));
  compressedLeft_ -= count;
  stream.next_in = reinterpret_cast<Bytef*>(state_->input.data());
  stream.avail_in = uInt(count);
}

/// Decompresses a part of the block. \return the number of bytes, which may be 0
std::size_t ZlibBlocks::inflateSome(std::span<std::byte> out) {
  constexpr std::size_t kMost = std::size_t{1} << 30;  // zlib counts in unsigned int
  z_stream& stream = state_->stream;
  refill();
  const bool hadInput = stream.avail_in > 0;
  const auto wanted = std::min(out.size(), kMost);
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = uInt(wanted);
  const int code = inflate(&stream, Z_NO_FLUSH);
  ended_ = code == Z_STREAM_END;
  const std::size_t made = wanted - stream.avail_out;
  if ((code != Z_OK && !ended_) || (made == 0 && !hadInput && !ended_)) refuseBlock();
  return made;
}

/// Reads the checksum behind the last byte of a block.
void ZlibBlocks::endBlock() {
  std::byte more{};
  while (!ended_)
    if (inflateSome({&more, 1}) > 0) refuseBlock();
  if (state_->stream.avail_in > 0 || compressedLeft_ > 0) refuseBlock();
}

std::size_t ZlibBlocks::read(std::span<std::byte> out) {
  std::size_t done = 0;
  while (done < out.size() && (left_ > 0 || next_ < blocks_.size())) {
    if (left_ == 0) beginBlock();
    const auto wanted = std::min<std::uint64_t>(out.size() - done, left_);
    const std::size_t made = inflateSome(out.subspan(done, std::size_t(wanted)));
    done += made;
    left_ -= made;
    if (left_ == 0) endBlock();
    if (left_ > 0 && ended_) refuseBlock();
  }
  return done;
}

}  // namespace esvr::samples
