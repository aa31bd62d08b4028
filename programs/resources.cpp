// The memory of a program: what the machine has, the options --max-memory and --scratch, and
// the shares of tasks. Its threads: the option --threads, tasks on several threads, and the order of their
// results.

#include "programs/resources.h"

#include <malloc.h>
#include <sys/resource.h>
#include <tbb/global_control.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <exception>
#include <fstream>
#include <limits>
#include <string>
#include <thread>

#include "esvr/error.h"
#include "programs/option_values.h"

namespace esvr::cli {

// What the machine and the process have.

namespace {

constexpr std::uint64_t kUnit = 1024;  // unit of the system's figures

/// Reads a line of one of the system's tables.
std::optional<std::uint64_t> bytesIn(const char* table, const std::string& key) {
  std::ifstream lines(table);
  for (std::string word; lines >> word;) {
    std::uint64_t value = 0;
    if (word == key && lines >> value) return value * kUnit;
  }
  return std::nullopt;
}

std::optional<std::uint64_t> statusBytes(const std::string& key) {
  return bytesIn("/proc/self/status", key);
}

/// Reads a file that holds one number; nothing if it holds a word such as "max" or does not exist.
std::optional<std::uint64_t> numberIn(const char* path) {
  std::ifstream file(path);
  std::uint64_t value = 0;
  return file >> value ? std::optional(value) : std::nullopt;
}

std::uint64_t difference(std::uint64_t limit, std::uint64_t held) {
  return limit > held ? limit - held : 0;
}

/// The memory that the limit of the process's control group (container) leaves.
std::uint64_t leftInGroup() {
  const auto limit = numberIn("/sys/fs/cgroup/memory.max");
  if (!limit) return std::numeric_limits<std::uint64_t>::max();
  return difference(*limit, numberIn("/sys/fs/cgroup/memory.current").value_or(0));
}

std::uint64_t leftInAddressSpace() {
  rlimit limit{};
  if (getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY)
    return std::numeric_limits<std::uint64_t>::max();
  return difference(limit.rlim_cur, statusBytes("VmSize:").value_or(0));
}

}  // namespace

std::uint64_t availableMemory() {
  const auto free = bytesIn("/proc/meminfo", "MemAvailable:").value_or(physicalMemory());
  return std::min({free, leftInGroup(), leftInAddressSpace()});
}

std::uint64_t physicalMemory() {
  return std::uint64_t(sysconf(_SC_PHYS_PAGES)) * std::uint64_t(sysconf(_SC_PAGESIZE));
}

std::uint64_t peakMemory() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return std::uint64_t(usage.ru_maxrss) * kUnit;
}

MemoryMeter::MemoryMeter() {
  malloc_trim(0);
  constexpr const char* kResetPeak = "5";  // see proc(5), clear_refs
  std::ofstream record("/proc/self/clear_refs");
  if (record << kResetPeak << std::flush) before_ = statusBytes("VmRSS:");
}

std::optional<std::uint64_t> MemoryMeter::peakRise() const {
  const auto peak = statusBytes("VmHWM:");
  if (!before_ || !peak) return std::nullopt;
  return *peak > *before_ ? *peak - *before_ : 0;
}

// The options.

namespace {

namespace fs = std::filesystem;

constexpr const char* kMaxMemory = "max-memory";
constexpr const char* kScratch = "scratch";
constexpr double kShare = 0.75;  // the rest is left to other programs

/// A source and its copy, with half of the memory for the work on them.
constexpr std::uint64_t kVolumesInMemory = 4;

std::uint64_t maxBytesOf(const Arguments& arguments) {
  if (const auto size = arguments.find<std::string>(kMaxMemory))
    return parseByteSize(kMaxMemory, *size);
  return std::uint64_t(kShare * double(availableMemory()));
}

fs::path requireFolder(const fs::path& folder, const std::string& given) {
  std::error_code unreadable;
  if (fs::is_directory(folder, unreadable)) return folder;
  throw UsageError(given + ": " + folder.string() + " is not a folder");
}

fs::path usualScratch() {
  const char* variable = std::getenv("TMPDIR");
  return variable && *variable ? variable : "/var/tmp";
}

/// Whoever writes a file there reports that the usual folder does not exist; most runs write none.
fs::path scratchOf(const Arguments& arguments) {
  const auto given = arguments.find<std::string>(kScratch);
  return given ? requireFolder(*given, "--" + std::string(kScratch)) : usualScratch();
}

}  // namespace

void addHostMemory(CommandLine& line) {
  line.options().add_options()(
      kMaxMemory, po::value<std::string>()->value_name("SIZE"),
      "memory that may be taken, for example 8GB (default: 3/4 of the memory that is available); "
      "voxels that need more than a quarter of it, alone or together, are kept in files; a run "
      "that needs more is refused with exit code 5, as far as this can be told before the work "
      "begins")(kScratch, po::value<std::string>()->value_name("DIR"),
                "folder for the file that holds voxels which do not fit into memory (default: "
                "$TMPDIR, or /var/tmp)");
}

fs::path scratchFolder() { return requireFolder(usualScratch(), "the variable TMPDIR"); }

fs::path scratchFolderOf(const Arguments& arguments) {
  return arguments.has(kScratch) ? scratchOf(arguments) : scratchFolder();
}

HostMemory hostMemoryOf(const Arguments& arguments) {
  const std::uint64_t maxBytes = maxBytesOf(arguments), share = maxBytes / kVolumesInMemory;
  return {maxBytes, VoxelMemory({scratchOf(arguments), share, share})};
}

// Shares for tasks.

MemoryGate::Part MemoryGate::take(std::uint64_t bytes) {
  const std::uint64_t wanted = std::min(bytes, all_);
  std::unique_lock lock(mutex_);
  const std::uint64_t ticket = nextTicket_++;
  changed_.wait(lock, [&] { return ticket == served_ && wanted <= all_ - taken_; });
  ++served_;
  taken_ += wanted;
  changed_.notify_all();
  return {*this, wanted};
}

void MemoryGate::giveBack(std::uint64_t bytes) {
  const std::lock_guard lock(mutex_);
  taken_ -= bytes;
  changed_.notify_all();
}

// ---- Devices and ranks

struct ThreadLimit::Control : tbb::global_control {
  explicit Control(int threads)
      : tbb::global_control(max_allowed_parallelism, std::size_t(threads)) {}
};

ThreadLimit::ThreadLimit(int threads)
    : control_(threads > 0 ? std::make_unique<Control>(threads) : nullptr) {}

ThreadLimit::~ThreadLimit() = default;

namespace {

class Workers {
 public:
  Workers(const TaskRun& run, const std::function<bool(const Task&)>& job) : run_(run), job_(job) {}

  void run() {
    {
      std::vector<std::jthread> threads;
      for (int worker = 1; worker < run_.workers; ++worker)
        threads.emplace_back([this, worker] { work(worker); });
      work(0);
    }
    if (error_) std::rethrow_exception(error_);
  }

 private:
  void work(int worker) noexcept try {
    const CancelScope scope(&run_.cancel);
    for (std::size_t i; !stopped() && (i = next_++) < run_.tasks;)
      if (!job_({i, worker}) && run_.onError == OnFrameError::kStop) stop_ = true;
  } catch (...) {
    const std::lock_guard lock(mutex_);
    if (!error_) error_ = std::current_exception();
    stop_ = true;
  }

  [[nodiscard]] bool stopped() const { return stop_ || run_.cancel.cancelled(); }

  const TaskRun& run_;
  const std::function<bool(const Task&)>& job_;
  std::atomic<std::size_t> next_{0};
  std::atomic<bool> stop_{false};
  std::mutex mutex_;
  std::exception_ptr error_;
};

}  // namespace

void forEachTask(const TaskRun& run, const std::function<bool(const Task&)>& job) {
  Workers(run, job).run();
}

int taskWorkers(int threads, std::size_t tasks) {
  const int all = threads > 0 ? threads : int(std::max(std::thread::hardware_concurrency(), 1u));
  return int(std::clamp<std::size_t>(tasks, 1, std::size_t(all)));
}

std::vector<std::size_t> framesWithInput(const std::vector<Frame>& frames) {
  std::vector<std::size_t> indices;
  for (std::size_t i = 0; i < frames.size(); ++i)
    if (!frames[i].missing) indices.push_back(i);
  return indices;
}

bool Turnstile::await(std::size_t task) {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return closed_ || next_ == task; });
  return !closed_;
}

void Turnstile::pass() {
  const std::lock_guard lock(mutex_);
  ++next_;
  changed_.notify_all();
}

void Turnstile::close() {
  const std::lock_guard lock(mutex_);
  closed_ = true;
  changed_.notify_all();
}

}  // namespace esvr::cli
