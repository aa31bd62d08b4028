#include "core/temporary_files.h"

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

namespace esvr {
namespace {

namespace fs = std::filesystem;

constexpr const char* kPrefix = ".esvr-";
constexpr const char* kSuffix = ".tmp";
constexpr std::size_t kDigits = 8;

std::string randomName() {
  std::random_device device;
  char digits[kDigits + 1];
  std::snprintf(digits, sizeof digits, "%08x", unsigned(device()));
  return std::string(kPrefix) + digits + kSuffix;
}

bool namedAsOurs(const std::string& name) {
  const std::string prefix = kPrefix, suffix = kSuffix;
  if (name.size() != prefix.size() + kDigits + suffix.size()) return false;
  if (!name.starts_with(prefix) || !name.ends_with(suffix)) return false;
  const auto digits = name.begin() + std::ptrdiff_t(prefix.size());
  return std::all_of(digits, digits + kDigits, [](unsigned char c) { return std::isxdigit(c); });
}

/// Waits for the lock. On a file system without locks there is none, and no file is removed.
void lock(int fd) {
  while (::flock(fd, LOCK_EX) != 0 && errno == EINTR) {
  }
}

/// True if another process has taken the file for a left-over file and removed it before it was
/// locked.
bool removed(int fd) {
  struct stat status {};
  return ::fstat(fd, &status) == 0 && status.st_nlink == 0;
}

bool isLeftOver(int fd) {
  struct stat status {};
  return ::fstat(fd, &status) == 0 && S_ISREG(status.st_mode) && status.st_uid == ::geteuid() &&
         ::flock(fd, LOCK_EX | LOCK_NB) == 0;
}

void removeIfLeftOver(const fs::path& path) {
  const int fd = ::open(path.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
  if (fd < 0) return;
  if (isLeftOver(fd)) ::unlink(path.c_str());
  ::close(fd);
}

}  // namespace

TemporaryFile createTemporary(const fs::path& directory, mode_t mode) {
  for (;;) {
    TemporaryFile file{directory / randomName(), -1};
    file.fd = ::open(file.path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, mode);
    if (file.fd < 0 && errno == EEXIST) continue;
    if (file.fd < 0) return file;
    lock(file.fd);
    if (!removed(file.fd)) return file;
    ::close(file.fd);
  }
}

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

void removeLeftOvers(const fs::path& directory) {
  std::error_code unreadable;
  for (fs::directory_iterator at(directory, unreadable), end; !unreadable && at != end;
       at.increment(unreadable))
    if (namedAsOurs(at->path().filename().string())) removeIfLeftOver(at->path());
}

}  // namespace esvr
