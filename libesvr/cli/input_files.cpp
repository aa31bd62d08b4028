#include "cli/input_files.h"

#include <fcntl.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <random>
#include <span>
#include <string_view>
#include <system_error>

#include "core/byte_text.h"
#include "core/publish_file.h"
#include "core/temporary_files.h"
#include "esvr/error.h"

namespace esvr::cli {
namespace {

namespace fs = std::filesystem;

/// The first bytes of the formats, at most kBeginBytes, which decide the extension of the copy.
struct PipedFormat {
  std::string_view begin, extension;
};
constexpr std::array kFormats{PipedFormat{{" BDV\0\0\0\0", 8}, ".vdb"},
                              PipedFormat{"NanoVDB", ".nvdb"},
                              PipedFormat{"\x89"
                                          "ESVR\r\n\n",
                                          ".esvr"}};
constexpr std::size_t kBeginBytes = 8;

std::string shownName(const std::string& input) {
  return input == kStandardInput ? "standard input" : input;
}

InputStream openInput(const std::string& input) {
  return input == kStandardInput ? InputStream::standardInput() : InputStream(input);
}

/// Reads until the buffer is full or the stream ends. \return the number of bytes
std::size_t fillBlock(InputStream& stream, std::span<std::byte> buffer) {
  std::size_t done = 0;
  while (done < buffer.size())
    if (const std::size_t n = stream.read(buffer.subspan(done)))
      done += n;
    else
      break;
  return done;
}

std::string_view extensionOf(std::span<const std::byte> bytes, const std::string& name) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()),
                              std::min(bytes.size(), kBeginBytes));
  for (const PipedFormat& format : kFormats)
    if (text.starts_with(format.begin)) return format.extension;
  throw BadInput(name + " is neither an OpenVDB nor a NanoVDB nor an .esvr file" +
                 (bytes.empty() ? ": it is empty" : ""));
}

/// A pipe may have no end, and a full disk disturbs other programs.
std::uint64_t mostBytes(const fs::path& folder) {
  struct statvfs disk {};
  if (::statvfs(folder.c_str(), &disk) != 0) failAt("cannot use ", folder, errno);
  return std::uint64_t(disk.f_bavail) * disk.f_frsize / 2;
}

/// A new link in the folder to an open file.
fs::path linkTo(int fd, const fs::path& folder, std::string_view extension) {
  const std::string target = "/proc/" + std::to_string(::getpid()) + "/fd/" + std::to_string(fd);
  std::random_device random;
  for (;;) {
    std::array<char, 9> digits{};
    std::snprintf(digits.data(), digits.size(), "%08x", unsigned(random()));
    const fs::path path =
        folder / ("esvr-piped-" + std::string(digits.data()) + std::string(extension));
    if (::symlink(target.c_str(), path.c_str()) == 0) return path;
    if (errno != EEXIST) failAt("cannot write ", path, errno);
  }
}

}  // namespace

bool PipedInput::isPipe(const std::string& input) {
  std::error_code missing;
  return input == kStandardInput || fs::is_fifo(input, missing);
}

PipedInput::PipedInput(const std::string& input, const fs::path& folder) {
  constexpr std::size_t kBlock = std::size_t{1} << 20;
  const std::string name = shownName(input);
  InputStream stream = openInput(input);
  std::vector<std::byte> block(kBlock);
  std::size_t n = fillBlock(stream, block);
  const std::string_view extension = extensionOf(std::span(block).first(n), name);
  const std::uint64_t most = mostBytes(folder);
  fd_ = createNameless(folder);
  if (fd_ < 0) failAt("cannot write a file in ", folder, errno);
  try {
    for (std::uint64_t total = n; n > 0; n = fillBlock(stream, block), total += n) {
      if (total > most)
        throw RuntimeFailure(name + " has more than " + byteText(double(most)) +
                             ", half of the space that " + folder.string() +
                             " has; --scratch names another folder");
      writeAll(fd_, std::span(block).first(n), folder);
    }
    path_ = linkTo(fd_, folder, extension);
  } catch (...) {
    ::close(fd_);
    throw;
  }
}

PipedInput::~PipedInput() {
  ::unlink(path_.c_str());
  ::close(fd_);
}

}  // namespace esvr::cli
