#pragma once
/// Bytes in memory as a source of a stream.

#include <cstddef>
#include <span>
#include <streambuf>

namespace esvr::vdb {

/// The bytes must outlive the buffer. They are only read.
class MemoryBuffer : public std::streambuf {
 public:
  explicit MemoryBuffer(std::span<const std::byte> bytes) {
    auto* first = const_cast<char*>(reinterpret_cast<const char*>(bytes.data()));
    setg(first, first, first + bytes.size());
  }

 protected:
  pos_type seekpos(pos_type position, std::ios_base::openmode /*which*/) override {
    if (position < 0 || position > egptr() - eback()) return pos_type(off_type(-1));
    setg(eback(), eback() + off_type(position), egptr());
    return position;
  }

  pos_type seekoff(off_type offset, std::ios_base::seekdir from,
                   std::ios_base::openmode which) override {
    if (from == std::ios_base::cur) offset += gptr() - eback();
    if (from == std::ios_base::end) offset += egptr() - eback();
    return seekpos(offset, which);
  }
};

}  // namespace esvr::vdb
