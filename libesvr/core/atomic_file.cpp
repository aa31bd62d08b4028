#include "core/atomic_file.h"

#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>

#include "core/publish_file.h"

namespace esvr {
namespace {

namespace fs = std::filesystem;

constexpr mode_t kPermissionBits = 07777;

/// The permissions of a file that exists.
mode_t modeOf(const fs::path& path) {
  struct stat status {};
  return ::lstat(path.c_str(), &status) == 0 ? status.st_mode & kPermissionBits : kNewFileMode;
}

}  // namespace

AtomicFile::AtomicFile(const fs::path& target, bool overwrite)
    : target_(followLinks(target)), overwrite_(overwrite) {
  keepStandardDescriptors();
  const bool exists = checkTarget(target_, overwrite);
  const fs::path directory = target_.has_parent_path() ? target_.parent_path() : fs::path(".");
  removeLeftOvers(directory);
  temporary_ = createTemporary(directory, exists ? modeOf(target_) : kNewFileMode);
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

}  // namespace esvr
