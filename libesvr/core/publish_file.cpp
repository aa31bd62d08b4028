#include "core/publish_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <string>
#include <system_error>

#include "esvr/error.h"
#include "esvr/progress.h"

namespace esvr {
namespace {

namespace fs = std::filesystem;

/// Writes the directory to the disk, so that the new name survives a power failure. Some file
/// systems cannot do this. The file is complete in any case, so errors are ignored.
void flushDirectory(const fs::path& directory) {
  const int fd = ::open(directory.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd < 0) return;
  ::fsync(fd);
  ::close(fd);
}

void rename(const fs::path& file, const fs::path& target, bool overwrite) {
  const unsigned flags = overwrite ? 0u : unsigned(RENAME_NOREPLACE);
  if (::renameat2(AT_FDCWD, file.c_str(), AT_FDCWD, target.c_str(), flags) == 0) return;
  // On a file system without RENAME_NOREPLACE, a hard link refuses an existing name as well.
  const bool unsupported = errno == EINVAL || errno == ENOSYS;
  if (overwrite || !unsupported) failAt("cannot name ", target, errno);
  if (::link(file.c_str(), target.c_str()) != 0) failAt("cannot name ", target, errno);
  ::unlink(file.c_str());
}

}  // namespace

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

bool checkTarget(const fs::path& target, bool overwrite) {
  struct stat status {};
  if (::lstat(target.c_str(), &status) != 0) return false;
  if (!S_ISREG(status.st_mode))
    throw RuntimeFailure("cannot write " + target.string() + ": it is not a regular file");
  if (!overwrite) throw RuntimeFailure("cannot write " + target.string() + ": it exists already");
  return true;
}

void publishFile(const fs::path& file, const fs::path& target, bool overwrite) {
  rename(file, target, overwrite);
  flushDirectory(file.has_parent_path() ? file.parent_path() : fs::path("."));
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

}  // namespace esvr
