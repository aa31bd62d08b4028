#include "vdb/files.h"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <ios>
#include <new>
#include <stdexcept>
#include <streambuf>
#include <system_error>

#include "core/counted.h"
#include "esvr/error.h"

namespace esvr::vdb {
namespace {

/// Large enough that the many short skips in a tree seldom need a system call.
constexpr std::size_t kBufferBytes = std::size_t{1} << 18;

std::uint64_t sizeOfRegularFile(const std::filesystem::path& path) {
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (status.type() == std::filesystem::file_type::not_found) throw BadInput("no such file");
  if (error) throw BadInput(error.message());
  if (status.type() == std::filesystem::file_type::directory) throw BadInput("is a directory");
  if (status.type() != std::filesystem::file_type::regular) throw BadInput("is not a regular file");
  const std::uint64_t size = std::filesystem::file_size(path, error);
  if (error) throw BadInput(error.message());
  if (size == 0) throw BadInput("is empty");
  return size;
}

/// Bytes in memory as a source of a stream. They must outlive the buffer, and are only read.
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

/// Rethrows errors that mean the same in reading and writing.
void rethrowCommon(const std::string& where) {
  try {
    throw;
  } catch (const Cancelled&) {
    throw;
  } catch (const NotFinite& e) {
    throw NotFinite(where + e.what());
  } catch (const CannotConvert& e) {
    throw CannotConvert(where + e.what());
  } catch (const BadInput& e) {
    throw BadInput(where + e.what());
  } catch (const UsageError& e) {
    throw UsageError(where + e.what());
  } catch (const MemoryExceeded& e) {
    throw MemoryExceeded(where + e.what());
  } catch (const RuntimeFailure& e) {
    throw RuntimeFailure(where + e.what());
  } catch (const Error& e) {
    throw Error(e.kind(), where + e.what());
  } catch (const std::bad_alloc&) {
    throw RuntimeFailure(where + "out of memory");
  } catch (const std::logic_error&) {
    throw;  // an error of this library, which must not look like an error of the file
  } catch (...) {
  }
}

}  // namespace

InputFile::InputFile(const std::filesystem::path& path)
    : buffer_(kBufferBytes), size_(sizeOfRegularFile(path)), end_(size_) {
  auto file = std::make_unique<std::ifstream>();
  file->rdbuf()->pubsetbuf(buffer_.data(), std::streamsize(buffer_.size()));
  errno = 0;
  file->open(path, std::ios::in | std::ios::binary);
  if (!*file) throw BadInput(std::string("cannot be opened: ") + std::strerror(errno));
  stream_ = std::move(file);
  throwAtErrors();
}

InputFile::InputFile(std::span<const std::byte> bytes)
    : memory_(std::make_unique<MemoryBuffer>(bytes)),
      stream_(std::make_unique<std::istream>(memory_.get())),
      size_(bytes.size()),
      end_(size_) {
  throwAtErrors();
}

void InputFile::throwAtErrors() {
  stream_->exceptions(std::ios::badbit | std::ios::failbit | std::ios::eofbit);
}

InputFile::Within::Within(InputFile& file, std::uint64_t end) : file_(file), before_(file.end_) {
  if (end > before_)
    throw BadInput("is truncated or damaged: it points to byte " + std::to_string(end) + ", " +
                   file.endText());
  file_.end_ = end;
}

std::string InputFile::endText() const {
  return (end_ == size_ ? "the file has " : "this part of the file ends at byte ") +
         std::to_string(end_);
}

void InputFile::need(std::uint64_t bytes) const {
  if (position_ > end_ || bytes > remaining())
    throw BadInput("is truncated or damaged: " + counted(bytes, "byte") + " expected at " +
                   std::to_string(position_) + ", " + endText());
}

void InputFile::seek(std::uint64_t position) {
  if (position > end_)
    throw BadInput("is truncated or damaged: it points to byte " + std::to_string(position) + ", " +
                   endText());
  stream_->seekg(std::streamoff(position));
  position_ = position;
}

void InputFile::skip(std::uint64_t bytes) {
  need(bytes);
  if (bytes > kBufferBytes) return seek(position_ + bytes);
  stream_->ignore(std::streamsize(bytes));
  position_ += bytes;
}

void InputFile::read(void* to, std::size_t bytes) {
  need(bytes);
  stream_->read(static_cast<char*>(to), std::streamsize(bytes));
  position_ += bytes;
}

std::vector<std::byte> InputFile::readBytes(std::uint64_t bytes) {
  need(bytes);
  std::vector<std::byte> result(bytes);
  read(result.data(), result.size());
  return result;
}

std::string InputFile::readString() {
  const auto length = read<std::uint32_t>();
  need(length);
  std::string text(length, '\0');
  read(text.data(), length);
  return text;
}

void InputFile::followStream() {
  position_ = std::uint64_t(stream_->tellg());
  need(0);
}

void rethrowWhileReading(const std::string& where) {
  rethrowCommon(where);
  try {
    throw;
  } catch (const std::ios_base::failure&) {
    throw BadInput(where + "is truncated or cannot be read");
  } catch (const std::exception& e) {
    throw BadInput(where + e.what());
  }
}

void rethrowWhileWriting(const std::string& where) {
  rethrowCommon(where);
  try {
    throw;
  } catch (const std::ios_base::failure&) {
    throw RuntimeFailure(where + "cannot be written: the disk is full or failing");
  } catch (const std::exception& e) {
    throw RuntimeFailure(where + e.what());
  }
}

}  // namespace esvr::vdb
