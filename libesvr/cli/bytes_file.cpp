#include "cli/bytes_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>

#include "core/atomic_file.h"
#include "core/publish_file.h"

namespace esvr::cli {
namespace {

/// Writes to a device or a pipe, which cannot be replaced by a complete file.
void writeDirectly(const std::filesystem::path& path, std::span<const std::byte> bytes) {
  const int fd = ::open(path.c_str(), O_WRONLY | O_CLOEXEC);
  if (fd < 0) failAt("cannot write ", path, errno);
  try {
    writeAll(fd, bytes, path);
  } catch (...) {
    ::close(fd);
    throw;
  }
  if (::close(fd) != 0) failAt("cannot write ", path, errno);
}

}  // namespace

void writeBytes(const std::filesystem::path& path, std::span<const std::byte> bytes,
                bool overwrite) {
  if (isWrittenDirectly(path)) return writeDirectly(path, bytes);
  AtomicFile file(path, overwrite);
  file.write(bytes);
  file.commit();
}

}  // namespace esvr::cli
