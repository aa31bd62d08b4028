#include "core/partial_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <utility>

#include "core/publish_file.h"
#include "esvr/error.h"

namespace esvr {
namespace {

namespace fs = std::filesystem;

int openFlags(PartialStart start) {
  constexpr int kAlways = O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK;
  return start == PartialStart::kRefuse ? kAlways | O_EXCL : kAlways;
}

}  // namespace

PartialFile::PartialFile(const fs::path& target, bool overwrite, PartialStart start)
    : target_(followLinks(target)), path_(pathFor(target_)), overwrite_(overwrite) {
  keepStandardDescriptors();
  try {
    while (!open(start)) {
    }
  } catch (...) {
    if (fd_ >= 0) ::close(fd_);
    throw;
  }
}

/// Opens and locks the file. Between the two, the process that wrote it may have completed it: what
/// is locked then is that process's output under its final name, which must not be touched.
/// \return false if this happened
bool PartialFile::open(PartialStart start) {
  checkTarget(target_, overwrite_);
  fd_ = ::open(path_.c_str(), openFlags(start), kNewFileMode);
  if (fd_ < 0) failAt("cannot write ", path_, errno);
  lock();
  struct stat own {
  }, named{};
  if (::fstat(fd_, &own) != 0) failAt("cannot write ", path_, errno);
  if (!S_ISREG(own.st_mode))
    throw RuntimeFailure("cannot write " + path_.string() + ": it is not a regular file");
  if (::lstat(path_.c_str(), &named) == 0 && own.st_dev == named.st_dev &&
      own.st_ino == named.st_ino)
    return true;
  ::close(std::exchange(fd_, -1));
  return false;
}

PartialFile::~PartialFile() {
  if (fd_ < 0) return;
  struct stat status {};
  if (::fstat(fd_, &status) == 0 && status.st_size == 0) ::unlink(path_.c_str());
  ::close(fd_);
}

fs::path PartialFile::pathFor(const fs::path& target) {
  return followLinks(target).string() + ".partial";
}

std::uint64_t PartialFile::size() const {
  struct stat status {};
  if (::fstat(fd_, &status) != 0) failAt("cannot read ", path_, errno);
  return std::uint64_t(status.st_size);
}

/// A file system without locks has no processes that exclude each other.
void PartialFile::lock() {
  if (::flock(fd_, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK)
    throw RuntimeFailure("cannot write " + path_.string() + ": another process writes it");
}

void PartialFile::append(std::span<const std::byte> bytes) {
  if (::lseek(fd_, 0, SEEK_END) < 0) failAt("cannot write ", path_, errno);
  writeAll(fd_, bytes, path_);
}

void PartialFile::replaceStart(std::span<const std::byte> bytes) {
  if (::lseek(fd_, 0, SEEK_SET) < 0) failAt("cannot write ", path_, errno);
  writeAll(fd_, bytes, path_);
}

void PartialFile::truncate(std::uint64_t size) {
  if (::ftruncate(fd_, off_t(size)) != 0) failAt("cannot shorten ", path_, errno);
}

void PartialFile::flush() {
  if (::fsync(fd_) != 0) failAt("cannot flush ", path_, errno);
}

void PartialFile::commit() {
  flush();
  publishFile(path_, target_, overwrite_);  // while the file is open, and thus locked
  ::close(fd_);
  fd_ = -1;
}

}  // namespace esvr
