#include "core/partial_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>

#include "core/publish_file.h"
#include "esvr/error.h"

namespace esvr {
namespace {

namespace fs = std::filesystem;

int openFlags(PartialStart start) {
  constexpr int kAlways = O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW;
  return start == PartialStart::kRefuse ? kAlways | O_EXCL : kAlways;
}

}  // namespace

PartialFile::PartialFile(const fs::path& target, bool overwrite, PartialStart start)
    : target_(followLinks(target)), path_(pathFor(target_)), overwrite_(overwrite) {
  checkTarget(target_, overwrite);
  fd_ = ::open(path_.c_str(), openFlags(start), kNewFileMode);
  if (fd_ < 0) failAt("cannot write ", path_, errno);
  try {
    lock();
    if (start == PartialStart::kReplace) truncate(0);
  } catch (...) {
    ::close(fd_);
    throw;
  }
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
