#pragma once
/// Bytes that are read from the first to the last, through decoders.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace esvr::samples {

class ByteStream {
 public:
  virtual ~ByteStream() = default;
  /// \return the number of bytes read; fewer than wanted only at the end
  virtual std::size_t read(std::span<std::byte> out) = 0;
};

/// Reads all bytes. \throws BadInput  there are fewer
void readAll(ByteStream& stream, std::span<std::byte> out);

/// A part of a file.
class FileBytes : public ByteStream {
 public:
  FileBytes(const std::filesystem::path& path, std::uint64_t begin, std::uint64_t end);
  std::size_t read(std::span<std::byte> out) override;

 private:
  std::ifstream file_;
  std::uint64_t left_;
};

/// Reads single bytes of another stream through a buffer.
class BufferedBytes {
 public:
  explicit BufferedBytes(std::unique_ptr<ByteStream> from) : from_(std::move(from)) {}
  /// Nothing at the end.
  std::optional<char> next();

 private:
  std::unique_ptr<ByteStream> from_;
  std::vector<std::byte> buffer_ = std::vector<std::byte>(std::size_t{1} << 16);
  std::size_t at_ = 0, filled_ = 0;
};

/// The bytes that base64 encodes. Blanks are left out. Padding ends a group of bytes, and further
/// groups may follow.
class Base64Bytes : public ByteStream {
 public:
  explicit Base64Bytes(std::unique_ptr<ByteStream> from) : from_(std::move(from)) {}
  /// \throws BadInput  there is a character that base64 does not have
  std::size_t read(std::span<std::byte> out) override;

 private:
  bool decodeGroup();

  BufferedBytes from_;
  std::byte group_[3] = {};
  std::size_t at_ = 0, decoded_ = 0;
};

/// The bytes of blocks that zlib compressed.
class ZlibBlocks : public ByteStream {
 public:
  struct Block {
    std::uint64_t bytes = 0, compressedBytes = 0;
  };
  /// \param blocks  none of them is empty
  ZlibBlocks(ByteStream& from, std::vector<Block> blocks);
  ~ZlibBlocks() override;
  /// \throws BadInput  a block is damaged, or is of another length
  std::size_t read(std::span<std::byte> out) override;

 private:
  struct State;
  void beginBlock();
  void endBlock();
  void refill();
  std::size_t inflateSome(std::span<std::byte> out);

  ByteStream& from_;
  std::vector<Block> blocks_;
  std::size_t next_ = 0;                         ///< index of the next block
  std::uint64_t left_ = 0, compressedLeft_ = 0;  ///< bytes of the current block
  bool ended_ = false;                           ///< the checksum of the block was read
  std::unique_ptr<State> state_;
};

}  // namespace esvr::samples
