// Runs the parts of a fit in chunks on the devices of this process, or on those of several ranks. In both
// cases, every device has a thread that takes one part after the other.

#include <dlfcn.h>
#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>
#include <xxhash.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <future>
#include <iterator>
#include <mutex>
#include <span>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "core/atomic_file.h"
#include "core/parse_text.h"
#include "esvr/device.h"
#include "esvr/error.h"
#include "esvr/workers.h"

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
  ::rmdir(folder_.c_str());  // rmdir fails if files of others are in it, or if it is a link
}

// ---- Ranks

namespace {

/// Calls work(device) for every device, each on its own thread, and waits for all calls.
/// \param stop  is called if a call fails, so that the others can end early
/// \throws Error  what the first call that failed threw, in the order of the devices
void onDevices(std::span<const Device> devices, const std::function<void(const Device&)>& work,
               const std::function<void()>& stop) {
  if (devices.size() == 1) return work(devices.front());
  std::vector<std::future<void>> running;
  for (const Device& device : devices)
    running.push_back(std::async(std::launch::async, [&, device, token = CancelScope::token()] {
      const CancelScope scope(token);
      try {
        work(device);
      } catch (...) {
        stop();
        throw;
      }
    }));
  for (auto& call : running) call.wait();
  for (auto& call : running) call.get();
}

/// The result of a part from the store, or what `fit` makes, which is then stored if it is complete.
/// \param store  may be null
/// \throws BadInput  the result in the store is damaged
std::vector<std::byte> storedOrFitted(PartStore* store, const RoundParts& parts, std::size_t part,
                                      const std::function<PartOutput()>& fit) {
  if (!store) return fit().bytes;
  const PartKey key = parts.keyOf(part);
  if (auto found = store->find(key)) return std::move(*found);
  PartOutput output = fit();
  if (output.complete) store->put(key, output.bytes);
  return std::move(output.bytes);
}

}  // namespace

// The devices of this process

/// Devices of one kind, which give the same results. Where one fails, the others do its parts.
class WorkingDevices {
 public:
  /// \param onLost  may be empty
  WorkingDevices(std::span<const Device> devices, LostDevice onLost) : onLost_(std::move(onLost)) {
    for (const Device& device : devices)
      if (std::ranges::count(left_, device) == 0) left_.push_back(device);
  }

  /// Fits a part on a device; if this device fails or has failed, on another one.
  /// \throws DeviceError  no device is left
  [[nodiscard]] PartOutput fit(const RoundParts& parts, std::size_t part, const Device& own) {
    for (;;) {
      const Device device = workingFor(own);
      try {
        return parts.fit(part, device);
      } catch (const DeviceError& error) {
        lose(device, error.what());
      }
    }
  }

 private:
  [[nodiscard]] Device workingFor(const Device& device) {
    const std::lock_guard lock(mutex_);
    if (left_.empty()) throw DeviceError("all devices have failed");
    if (std::ranges::count(left_, device) > 0) return device;
    return left_[next_++ % left_.size()];
  }

  /// To be called while the device's error is handled, which is thrown again if no device is left.
  void lose(const Device& device, const std::string& why) {
    const std::lock_guard lock(mutex_);
    const bool isKnown = std::erase(left_, device) == 0;
    if (left_.empty()) throw;
    if (!isKnown && onLost_) onLost_(device, why);
  }

  std::mutex mutex_;
  std::vector<Device> left_;  ///< without repetitions
  std::size_t next_ = 0;      ///< counts the parts that were given to another device
  LostDevice onLost_;
};

DeviceWorkers::DeviceWorkers(std::vector<Device> devices, LostDevice onLost, PartStore* store)
    : devices_(std::move(devices)),
      working_(std::make_unique<WorkingDevices>(devices_, std::move(onLost))),
      store_(store) {}

DeviceWorkers::~DeviceWorkers() = default;

std::vector<std::vector<std::byte>> DeviceWorkers::run(const RoundParts& parts) {
  std::vector<std::vector<std::byte>> results(parts.count());
  std::atomic<std::size_t> next{0};
  const auto work = [&](const Device& device) {
    for (std::size_t p = next++; p < parts.count(); p = next++)
      results[p] =
          storedOrFitted(store_, parts, p, [&] { return working_->fit(parts, p, device); });
  };
  onDevices(devices_, work, [&] { next = parts.count(); });
  return results;
}

// The ranks

RankWorkers::RankWorkers(Ranks& ranks, std::vector<Device> devices, PartStore* store)
    : ranks_(ranks), devices_(std::move(devices)), store_(store) {}

std::vector<std::vector<std::byte>> RankWorkers::run(const RoundParts& parts) {
  const PartKey key = parts.keyOf(0);
  if (!ranks_.agree(key[0] ^ parts.count()))
    throw RuntimeFailure(
        "the ranks have divided the volume differently; give the same --chunk-voxels, or the same "
        "--max-vram, to all of them");
  ranks_.handOut(parts.count());
  std::vector<std::optional<std::vector<std::byte>>> own(parts.count());
  std::atomic<bool> stopped{false};
  const auto work = [&](const Device& device) {
    while (const auto part = ranks_.next())
      if (!stopped)
        own[*part] = storedOrFitted(store_, parts, *part, [&] { return parts.fit(*part, device); });
  };
  onDevices(devices_, work, [&] { stopped = true; });
  return ranks_.exchange(std::move(own));
}

std::unique_ptr<Ranks> joinRanks() {
  // The number of processes that were started together, by the variables of Open MPI, of MPICH and of
  // Slurm's plugins for them.
  std::int64_t count = 1;
  if (std::getenv("PMIX_RANK") != nullptr || std::getenv("PMI_RANK") != nullptr)
    for (const char* name : {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "SLURM_STEP_NUM_TASKS"})
      if (const char* text = std::getenv(name)) {
        count = parseWhole(text).value_or(1);
        break;
      }
  if (count <= 1) return nullptr;
  // Only processes that MPI has started load the module with MPI (mpi_ranks.cpp). Other processes thus
  // need no MPI.
  const std::string moduleName = "esvr_mpi.so";
  const std::string problem = "this process is one of " + std::to_string(count) +
                              " that were started together, but MPI cannot be used: ";
  void* const module = ::dlopen(moduleName.c_str(), RTLD_NOW | RTLD_LOCAL);  // stays loaded
  if (!module) throw RuntimeFailure(problem + ::dlerror());
  const auto join = reinterpret_cast<Ranks* (*)()>(::dlsym(module, "esvrJoinMpi"));
  if (!join) throw RuntimeFailure(problem + moduleName + " is not a part of this program");
  return std::unique_ptr<Ranks>(join());
}

}  // namespace esvr
