#include "esvr/workers.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>
#include <xxhash.h>

#include <array>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <iterator>
#include <system_error>
#include <utility>

#include "core/atomic_file.h"
#include "esvr/device.h"
#include "esvr/error.h"

namespace esvr {
namespace {

namespace fs = std::filesystem;

constexpr const char* kLock = "lock";
constexpr const char* kOrigin = "origin";
constexpr const char* kResult = ".part";
constexpr mode_t kMode = 0666;  // reduced by the process's umask

/// The start of a file with a result.
struct ResultHead {
  static constexpr std::uint64_t kMagic = 0x31545250'52565345;  // "ESVRPRT1"
  std::uint64_t magic = kMagic, bytes = 0, hash = 0;
};

[[noreturn]] void fail(const fs::path& path, int error) {
  throw RuntimeFailure("cannot use " + path.string() + ": " +
                       std::system_category().message(error));
}

/// The files in the folder are made by this class. A link or a pipe was put there by somebody else,
/// and writing to what it leads to would destroy another file.
void requirePlainFile(const fs::path& path) {
  std::error_code missing;
  const auto type = fs::symlink_status(path, missing).type();
  if (type != fs::file_type::regular && type != fs::file_type::not_found)
    throw RuntimeFailure("cannot use " + path.string() + ": it is not a regular file");
}

/// Locks a file, which is created if it is missing. \return nothing if another process has the lock
std::optional<PartStore::Lock> tryLock(const fs::path& path, int operation) {
  requirePlainFile(path);
  keepStandardDescriptors();
  const int fd =
      ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK, kMode);
  if (fd < 0) fail(path, errno);
  PartStore::Lock lock(fd);
  if (::flock(fd, operation | LOCK_NB) == 0) return lock;
  if (errno != EWOULDBLOCK) fail(path, errno);
  return std::nullopt;
}

PartStore::Lock lockFolder(const fs::path& folder, PartStore::Access access) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) fail(folder, error.value());
  auto lock = tryLock(folder / kLock, access == PartStore::Access::kAlone ? LOCK_EX : LOCK_SH);
  if (!lock) throw RuntimeFailure("another process uses " + folder.string());
  return std::move(*lock);
}

std::string textOf(const std::vector<PartOrigin>& origin) {
  std::string text;
  for (const auto& [name, value] : origin) text += name + ' ' + value + '\n';
  return text;
}

/// True for the names of files that a PartStore makes.
bool isOurName(const std::string& name) {
  if (name == kLock || name == kOrigin) return true;
  const std::string stem = fs::path(name).stem().string();
  constexpr std::size_t kDigits = 32;
  return fs::path(name).extension() == kResult && stem.size() == kDigits &&
         stem.find_first_not_of("0123456789abcdef") == std::string::npos;
}

std::vector<std::string> linesOf(const fs::path& path) {
  std::ifstream in(path);
  std::vector<std::string> lines;
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

}  // namespace

PartStore::Lock::Lock(Lock&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}

PartStore::Lock::~Lock() {
  if (fd_ >= 0) ::close(fd_);
}

PartStore::PartStore(fs::path folder, const std::vector<PartOrigin>& origin, Access access)
    : folder_(std::move(folder)), lock_(lockFolder(folder_, access)) {
  requirePlainFile(folder_ / kOrigin);
  if (!fs::exists(folder_ / kOrigin)) {
    const std::string text = textOf(origin);
    AtomicFile file(folder_ / kOrigin, true);
    file.write(std::as_bytes(std::span(text)));
    file.commit();
  }
  checkOrigin(origin);
}

void PartStore::checkOrigin(const std::vector<PartOrigin>& origin) const {
  const auto lines = linesOf(folder_ / kOrigin);
  for (std::size_t n = 0; n < origin.size(); ++n) {
    const auto& [name, value] = origin[n];
    const std::string found = n < lines.size() ? lines[n] : "";
    if (found == name + ' ' + value) continue;
    const bool isNamed = found.starts_with(name + ' ');
    throw BadInput(folder_.string() + " belongs to another run: its " + name + " is " +
                   (isNamed ? found.substr(name.size() + 1) : "unknown") + ", not " + value);
  }
}

fs::path PartStore::fileOf(const PartKey& key) const {
  std::array<char, 33> digits{};
  std::snprintf(digits.data(), digits.size(), "%016llx%016llx",
                static_cast<unsigned long long>(key[1]), static_cast<unsigned long long>(key[0]));
  return folder_ / (std::string(digits.data()) + kResult);
}

std::optional<std::vector<std::byte>> PartStore::find(const PartKey& key) const {
  const fs::path path = fileOf(key);
  requirePlainFile(path);
  std::ifstream in(path, std::ios::binary);
  if (!in) return std::nullopt;
  ResultHead head;
  in.read(reinterpret_cast<char*>(&head), sizeof head);
  const std::vector<char> text{std::istreambuf_iterator<char>(in), {}};
  const bool isWhole = head.magic == ResultHead::kMagic && head.bytes == text.size() &&
                       head.hash == XXH3_64bits(text.data(), text.size());
  if (!isWhole)
    throw BadInput(path.string() + " is damaged; remove it, and the part will be fitted again");
  const auto bytes = std::as_bytes(std::span(text));
  return std::vector<std::byte>(bytes.begin(), bytes.end());
}

void PartStore::put(const PartKey& key, std::span<const std::byte> result) {
  const ResultHead head{.bytes = result.size(), .hash = XXH3_64bits(result.data(), result.size())};
  requirePlainFile(fileOf(key));
  const Completion completion;  // a part that is complete is kept
  AtomicFile file(fileOf(key), true);
  file.write(std::as_bytes(std::span(&head, 1)));
  file.write(result);
  file.commit();
}

void PartStore::remove() {
  std::error_code ignored;  // files that cannot be removed do no harm: OUT.esvr is complete
  std::vector<fs::path> ours;
  for (fs::directory_iterator at(folder_, ignored), end; !ignored && at != end;
       at.increment(ignored))
    if (isOurName(at->path().filename().string())) ours.push_back(at->path());
  for (const fs::path& file : ours) fs::remove(file, ignored);
  removeLeftOvers(folder_);
  ::rmdir(folder_.c_str());  // which fails if files of others are in it, or if it is a link
}

}  // namespace esvr
