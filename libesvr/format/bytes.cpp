#include "format/bytes.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

namespace esvr::format {
namespace {

[[noreturn]] void failToRead(const std::string& name, int error) {
  throw BadInput("cannot read " + name + ": " + std::system_category().message(error));
}

}  // namespace

std::vector<std::byte> ByteSource::read(std::uint64_t offset, std::uint64_t n) const {
  if (offset > size() || n > size() - offset)
    throw BadInput(name_ + ": truncated: no room for " + counted(n, "byte") + " at byte " +
                   std::to_string(offset) + " of a file of " + std::to_string(size()));
  std::vector<std::byte> bytes(n);
  fill(offset, bytes);
  bytesRead_ += n;
  return bytes;
}

void MemorySource::fill(std::uint64_t offset, std::span<std::byte> out) const {
  std::copy_n(bytes_.begin() + std::ptrdiff_t(offset), out.size(), out.begin());
}

void BufferSource::fill(std::uint64_t offset, std::span<std::byte> out) const {
  std::copy_n(bytes_.begin() + std::ptrdiff_t(offset), out.size(), out.begin());
}

void PartSource::fill(std::uint64_t offset, std::span<std::byte> out) const {
  const auto bytes = whole_.read(offset_ + offset, out.size());
  std::copy(bytes.begin(), bytes.end(), out.begin());
}

FileSource::FileSource(const std::filesystem::path& path)
    : ByteSource(path.string()), fd_(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)) {
  if (fd_ < 0) failToRead(name(), errno);
  struct stat status {};
  const bool known = ::fstat(fd_, &status) == 0;
  const int error = errno;
  if (known && S_ISREG(status.st_mode)) {
    size_ = std::uint64_t(status.st_size);
    return;
  }
  ::close(fd_);
  if (!known) failToRead(name(), error);
  throw BadInput("cannot read " + name() + ": it is not a regular file");
}

FileSource::~FileSource() { ::close(fd_); }

void FileSource::fill(std::uint64_t offset, std::span<std::byte> out) const {
  while (!out.empty()) {
    const ssize_t n = ::pread(fd_, out.data(), out.size(), off_t(offset));
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) failToRead(name(), errno);
    if (n == 0) throw BadInput(name() + ": became shorter while it was read");
    out = out.subspan(std::size_t(n));
    offset += std::uint64_t(n);
  }
}

}  // namespace esvr::format
