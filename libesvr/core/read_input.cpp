#include "core/read_input.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <system_error>
#include <thread>
#include <utility>

#include "esvr/error.h"

namespace esvr {
namespace {

namespace fs = std::filesystem;

/// Time in which another program must open a pipe for writing. A shell starts the program of
/// `<(...)` at the same time as this one.
constexpr std::chrono::seconds kWaitForWriter{5};
constexpr std::chrono::milliseconds kLookForWriter{20};

/// Cameras, transfer functions and baselines are much smaller; the limit stops endless pipes.
constexpr std::size_t kMostTextBytes = std::size_t{1} << 28;

[[noreturn]] void failToRead(const std::string& name, const std::string& why) {
  throw BadInput("cannot read " + name + ": " + why);
}

[[noreturn]] void failToRead(const std::string& name, int error) {
  failToRead(name, std::system_category().message(error));
}

}  // namespace

// Without O_NONBLOCK, opening a pipe would wait for a program that writes to it.
InputStream::InputStream(const fs::path& path)
    : InputStream(path.string(), ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)) {
  if (fd_ < 0) failToRead(name_, errno);
  struct stat status {};
  if (::fstat(fd_, &status) != 0) failToRead(name_, errno);
  mayHaveNoWriter_ = S_ISFIFO(status.st_mode);
  if (S_ISDIR(status.st_mode)) failToRead(name_, "it is a folder");
  if (!S_ISREG(status.st_mode) && !S_ISFIFO(status.st_mode))
    failToRead(name_, "it is neither a file nor a pipe");
}

InputStream InputStream::standardInput() {
  const std::string name = "standard input";
  const int fd = ::fcntl(STDIN_FILENO, F_DUPFD_CLOEXEC, STDERR_FILENO + 1);
  if (fd < 0) failToRead(name, errno);
  InputStream stream(name, fd);
  if (::isatty(fd)) failToRead(name, "it is a terminal; a file or a pipe is needed");
  return stream;
}

InputStream::InputStream(InputStream&& other) noexcept
    : name_(std::move(other.name_)),
      fd_(std::exchange(other.fd_, -1)),
      mayHaveNoWriter_(other.mayHaveNoWriter_) {}

InputStream::~InputStream() {
  if (fd_ >= 0) ::close(fd_);
}

std::size_t InputStream::read(std::span<std::byte> to) {
  const auto giveUp = std::chrono::steady_clock::now() + kWaitForWriter;
  for (;;) {
    const ssize_t n = ::read(fd_, to.data(), to.size());
    if (n > 0 || (n == 0 && !mayHaveNoWriter_)) {
      mayHaveNoWriter_ = false;
      return std::size_t(n);
    }
    if (n == 0) {
      if (std::chrono::steady_clock::now() > giveUp)
        failToRead(name_, "it is a pipe, and no program writes to it");
      std::this_thread::sleep_for(kLookForWriter);
    } else if (errno == EAGAIN) {  // a program has opened the pipe and has not written yet
      mayHaveNoWriter_ = false;
      constexpr int kNoTimeout = -1;
      pollfd wait{fd_, POLLIN, 0};
      ::poll(&wait, 1, kNoTimeout);
    } else if (errno != EINTR) {
      failToRead(name_, errno);
    }
  }
}

std::string readText(const fs::path& path) {
  constexpr std::size_t kBlock = std::size_t{1} << 16;
  InputStream stream(path);
  std::string text;
  std::vector<std::byte> block(kBlock);
  while (const std::size_t n = stream.read(block)) {
    if (text.size() + n > kMostTextBytes)
      failToRead(path.string(), "it has more than " + std::to_string(kMostTextBytes) + " bytes");
    text.append(reinterpret_cast<const char*>(block.data()), n);
  }
  return text;
}

std::optional<FileStamp> stampOf(const fs::path& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) return std::nullopt;
  return FileStamp{std::uint64_t(status.st_dev), std::uint64_t(status.st_ino),
                   std::uint64_t(status.st_size), status.st_mtim.tv_sec, status.st_mtim.tv_nsec};
}

WatchedInputs::WatchedInputs(const std::vector<fs::path>& paths) {
  for (const fs::path& path : paths) add(path);
}

void WatchedInputs::add(const fs::path& path) {
  if (const auto stamp = stampOf(path)) files_.push_back({path, *stamp});
}

void WatchedInputs::requireUnchanged() const {
  for (const Watched& file : files_) {
    const auto now = stampOf(file.path);
    if (now == file.stamp) continue;
    const bool isSame = now && now->device == file.stamp.device && now->inode == file.stamp.inode;
    throw BadInput(file.path.string() + " was " +
                   (!now     ? "removed"
                    : isSame ? "changed"
                             : "replaced") +
                   " while it was read; run the command again when it is complete");
  }
}

}  // namespace esvr
