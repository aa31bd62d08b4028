#include "core/atomic_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <string>
#include <system_error>
#include <utility>

#include "esvr/device.h"
#include "esvr/error.h"

namespace esvr {
namespace {
namespace fs = std::filesystem;
}  // namespace

// What all output files share.

void keepStandardDescriptors() {
  for (const int fd : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (::fcntl(fd, F_GETFD) >= 0 || errno != EBADF) continue;
    // open() returns the lowest number that is free, which is `fd` unless another thread is faster.
    const int opened = ::open("/dev/null", fd == STDIN_FILENO ? O_WRONLY : O_RDONLY);
    if (opened > STDERR_FILENO) ::close(opened);
  }
}

fs::path followLinks(const fs::path& path) {
  std::error_code ignored;  // open() reports a path that cannot be resolved
  const fs::path resolved = fs::weakly_canonical(path, ignored);
  return resolved.empty() ? path : resolved;
}

bool isWrittenDirectly(const fs::path& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) return false;
  return S_ISCHR(status.st_mode) || S_ISFIFO(status.st_mode) || S_ISSOCK(status.st_mode);
}

void failAt(const char* what, const fs::path& path, int error) {
  throw RuntimeFailure(what + path.string() + ": " + std::system_category().message(error));
}

void writeAll(int fd, std::span<const std::byte> bytes, const fs::path& path) {
  constexpr std::size_t kPiece = std::size_t{1}
                                 << 24;  // a slow disk takes a tenth of a second for it
  while (!bytes.empty()) {
    CancelScope::check();
    const ssize_t n = ::write(fd, bytes.data(), std::min(bytes.size(), kPiece));
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) failAt("cannot write ", path, errno);
    bytes = bytes.subspan(std::size_t(n));
  }
}

namespace {

/// Refuses a target that exists (without `overwrite`) or is not a regular file. \return whether it exists
bool checkTarget(const fs::path& target, bool overwrite) {
  struct stat status {};
  if (::lstat(target.c_str(), &status) != 0) return false;
  if (!S_ISREG(status.st_mode))
    throw RuntimeFailure("cannot write " + target.string() + ": it is not a regular file");
  if (!overwrite) throw RuntimeFailure("cannot write " + target.string() + ": it exists already");
  return true;
}

/// Renames a file that was flushed, and flushes the folder.
void publishFile(const fs::path& file, const fs::path& target, bool overwrite) {
  const unsigned flags = overwrite ? 0u : unsigned(RENAME_NOREPLACE);
  if (::renameat2(AT_FDCWD, file.c_str(), AT_FDCWD, target.c_str(), flags) != 0) {
    // On a file system without RENAME_NOREPLACE, a hard link refuses an existing name as well.
    const bool unsupported = errno == EINVAL || errno == ENOSYS;
    if (overwrite || !unsupported) failAt("cannot name ", target, errno);
    if (::link(file.c_str(), target.c_str()) != 0) failAt("cannot name ", target, errno);
    ::unlink(file.c_str());
  }
  // The directory is written to the disk, so that the new name survives a power failure. Some file
  // systems cannot do this. The file is complete in any case, so errors are ignored.
  const fs::path directory = file.has_parent_path() ? file.parent_path() : fs::path(".");
  const int fd = ::open(directory.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd < 0) return;
  ::fsync(fd);
  ::close(fd);
}

}  // namespace

// Temporary files.

int createNameless(const fs::path& directory) {
  constexpr mode_t kOwnerOnly = 0600;
  const int fd = ::open(directory.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, kOwnerOnly);
  if (fd >= 0 || (errno != EOPNOTSUPP && errno != EISDIR)) return fd;
  // A file system without such files: the file loses its name at once.
  std::string name = (directory / "esvr-XXXXXX").string();
  const int named = ::mkostemp(name.data(), O_CLOEXEC);
  if (named >= 0) ::unlink(name.c_str());
  return named;
}

namespace {

constexpr const char* kTemporaryPrefix = ".esvr-";
constexpr const char* kTemporarySuffix = ".tmp";
constexpr std::size_t kTemporaryDigits = 8;

std::string temporaryName() {
  std::random_device device;
  char digits[kTemporaryDigits + 1];
  std::snprintf(digits, sizeof digits, "%08x", unsigned(device()));
  return std::string(kTemporaryPrefix) + digits + kTemporarySuffix;
}

bool namedAsOurs(const std::string& name) {
  const std::string prefix = kTemporaryPrefix, suffix = kTemporarySuffix;
  if (name.size() != prefix.size() + kTemporaryDigits + suffix.size()) return false;
  if (!name.starts_with(prefix) || !name.ends_with(suffix)) return false;
  const auto digits = name.begin() + std::ptrdiff_t(prefix.size());
  return std::all_of(digits, digits + kTemporaryDigits,
                     [](unsigned char c) { return std::isxdigit(c); });
}

/// Creates a file with a new name in a directory.
TemporaryFile createTemporary(const fs::path& directory, mode_t mode) {
  for (;;) {
    TemporaryFile file{directory / temporaryName(), -1};
    file.fd = ::open(file.path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, mode);
    if (file.fd < 0 && errno == EEXIST) continue;
    if (file.fd < 0) return file;
    // On a file system without locks there is none to wait for, and no file is removed.
    while (::flock(file.fd, LOCK_EX) != 0 && errno == EINTR) {
    }
    // Another process may have taken the file for a left-over file and removed it before it was locked.
    struct stat status {};
    const bool removed = ::fstat(file.fd, &status) == 0 && status.st_nlink == 0;
    if (!removed) return file;
    ::close(file.fd);
  }
}

void removeIfLeftOver(const fs::path& path) {
  const int fd = ::open(path.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
  if (fd < 0) return;
  struct stat status {};
  if (::fstat(fd, &status) == 0 && S_ISREG(status.st_mode) && status.st_uid == ::geteuid() &&
      ::flock(fd, LOCK_EX | LOCK_NB) == 0)
    ::unlink(path.c_str());
  ::close(fd);
}

}  // namespace

void removeLeftOvers(const fs::path& directory) {
  std::error_code unreadable;
  for (fs::directory_iterator at(directory, unreadable), end; !unreadable && at != end;
       at.increment(unreadable))
    if (namedAsOurs(at->path().filename().string())) removeIfLeftOver(at->path());
}

// AtomicFile.

AtomicFile::AtomicFile(const fs::path& target, bool overwrite)
    : target_(followLinks(target)), overwrite_(overwrite) {
  constexpr mode_t kPermissionBits = 07777;
  keepStandardDescriptors();
  mode_t mode = kNewFileMode;
  struct stat status {};
  if (checkTarget(target_, overwrite) && ::lstat(target_.c_str(), &status) == 0)
    mode = status.st_mode & kPermissionBits;
  const fs::path directory = target_.has_parent_path() ? target_.parent_path() : fs::path(".");
  removeLeftOvers(directory);
  temporary_ = createTemporary(directory, mode);
  if (temporary_.fd < 0) failAt("cannot write ", target_, errno);
}

AtomicFile::~AtomicFile() {
  // Removed before the lock is released, since another process may remove an unlocked file.
  if (!committed_) ::unlink(temporary_.path.c_str());
  if (temporary_.fd >= 0) ::close(temporary_.fd);
}

void AtomicFile::write(std::span<const std::byte> bytes) {
  writeAll(temporary_.fd, bytes, target_);
}

void AtomicFile::commit() {
  if (::fsync(temporary_.fd) != 0) failAt("cannot flush ", target_, errno);
  publishFile(temporary_.path, target_, overwrite_);  // while the file is open, and thus locked
  committed_ = true;
}

// PartialFile.

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
  const int exclusive = start == PartialStart::kRefuse ? O_EXCL : 0;
  fd_ = ::open(path_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK | exclusive,
               kNewFileMode);
  if (fd_ < 0) failAt("cannot write ", path_, errno);
  // A file system without locks has no processes that exclude each other.
  if (::flock(fd_, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK)
    throw RuntimeFailure("cannot write " + path_.string() + ": another process writes it");
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
