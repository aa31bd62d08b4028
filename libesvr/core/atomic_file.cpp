#include "core/atomic_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <string>
#include <system_error>

#include "esvr/error.h"

namespace esvr {
namespace {

namespace fs = std::filesystem;

constexpr mode_t kNewFileMode = 0666;  // reduced by the process's umask
constexpr mode_t kPermissionBits = 07777;

/// Follows symbolic links to the file itself, so that a link is not replaced.
fs::path followLinks(const fs::path& target) {
  std::error_code ignored;  // open() reports a path that cannot be resolved
  const fs::path resolved = fs::weakly_canonical(target, ignored);
  return resolved.empty() ? target : resolved;
}

/// Writes the directory to the disk, so that the new name survives a power failure. Some file
/// systems cannot do this. The file is complete in any case, so errors are ignored.
void flushDirectory(const fs::path& directory) {
  const int fd = ::open(directory.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd < 0) return;
  ::fsync(fd);
  ::close(fd);
}

}  // namespace

AtomicFile::AtomicFile(const fs::path& target, bool overwrite)
    : target_(followLinks(target)), overwrite_(overwrite) {
  struct stat status {};
  const bool exists = ::lstat(target_.c_str(), &status) == 0;
  if (exists && !S_ISREG(status.st_mode))
    throw RuntimeFailure("cannot write " + target_.string() + ": it is not a regular file");
  if (exists && !overwrite)
    throw RuntimeFailure("cannot write " + target_.string() + ": it exists already");
  const fs::path directory = target_.has_parent_path() ? target_.parent_path() : fs::path(".");
  removeLeftOvers(directory);
  temporary_ = createTemporary(directory, exists ? status.st_mode & kPermissionBits : kNewFileMode);
  if (temporary_.fd < 0) fail("cannot write ", errno);
}

AtomicFile::~AtomicFile() {
  // Removed before the lock is released, since another process may remove an unlocked file.
  if (!committed_) ::unlink(temporary_.path.c_str());
  if (temporary_.fd >= 0) ::close(temporary_.fd);
}

void AtomicFile::write(std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t n = ::write(temporary_.fd, bytes.data(), bytes.size());
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) fail("cannot write ", errno);
    bytes = bytes.subspan(std::size_t(n));
  }
}

void AtomicFile::commit() {
  if (::fsync(temporary_.fd) != 0) fail("cannot flush ", errno);
  rename();  // while the file is open, and therefore locked
  committed_ = true;
  flushDirectory(temporary_.path.parent_path());
}

void AtomicFile::rename() {
  const unsigned flags = overwrite_ ? 0u : unsigned(RENAME_NOREPLACE);
  if (::renameat2(AT_FDCWD, temporary_.path.c_str(), AT_FDCWD, target_.c_str(), flags) == 0) return;
  // On a file system without RENAME_NOREPLACE, a hard link refuses an existing name as well.
  const bool unsupported = errno == EINVAL || errno == ENOSYS;
  if (overwrite_ || !unsupported) fail("cannot name ", errno);
  if (::link(temporary_.path.c_str(), target_.c_str()) != 0) fail("cannot name ", errno);
  ::unlink(temporary_.path.c_str());
}

void AtomicFile::fail(const char* what, int error) const {
  throw RuntimeFailure(what + target_.string() + ": " + std::system_category().message(error));
}

}  // namespace esvr
