/// Voxels in memory or in files.

#include "esvr/volume.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <mutex>
#include <new>
#include <string>
#include <system_error>
#include <thread>

#include "core/atomic_file.h"
#include "core/memory_budget.h"
#include "esvr/error.h"

namespace esvr {

/// Files without names that are mapped into memory, and a thread that limits how much of them is in
/// the memory of the process.
class VoxelFiles {
 public:
  explicit VoxelFiles(VoxelMemory::Files options) : options_(std::move(options)) {}
  ~VoxelFiles();
  VoxelFiles(const VoxelFiles&) = delete;
  VoxelFiles& operator=(const VoxelFiles&) = delete;

  [[nodiscard]] const VoxelMemory::Files& options() const { return options_; }

  /// Maps a new file, whose bytes are 0. Its place on the disk is reserved, so that writing to the
  /// memory cannot fail.
  /// \throws RuntimeFailure  the folder cannot be written, or its disk is full
  [[nodiscard]] void* map(std::size_t bytes);
  void unmap(void* array, std::size_t bytes) noexcept;

 private:
  void watch();

  VoxelMemory::Files options_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::map<void*, std::size_t> mapped_;  ///< sizes by addresses
  bool done_ = false;
  std::thread watcher_;  ///< runs from the first file on
};

VoxelFiles::~VoxelFiles() {
  {
    const std::lock_guard lock(mutex_);
    done_ = true;
  }
  changed_.notify_all();
  if (watcher_.joinable()) watcher_.join();
}

void* VoxelFiles::map(std::size_t bytes) {
  keepStandardDescriptors();
  const auto fail = [&](int error) {
    throw RuntimeFailure("cannot keep " + byteText(double(bytes)) + " of voxels in a file in " +
                         options_.folder.string() + ": " + std::system_category().message(error));
  };
  const int fd = createNameless(options_.folder);
  if (fd < 0) fail(errno);
  int error = EINTR;
  while (error == EINTR) error = ::posix_fallocate(fd, 0, off_t(bytes));
  void* const array =
      error == 0 ? ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0) : MAP_FAILED;
  if (error == 0 && array == MAP_FAILED) error = errno;
  ::close(fd);
  if (error != 0) fail(error);
  const std::lock_guard lock(mutex_);
  mapped_.emplace(array, bytes);
  if (!watcher_.joinable()) watcher_ = std::thread([this] { watch(); });
  return array;
}

void VoxelFiles::unmap(void* array, std::size_t bytes) noexcept {
  const std::lock_guard lock(mutex_);
  mapped_.erase(array);
  ::munmap(array, bytes);
}

void VoxelFiles::watch() {
  // Time between two looks at the memory in use. A look takes 20 microseconds; a program that scans
  // voxels on all cores reaches some 100 MB between two looks.
  constexpr std::chrono::milliseconds kLookEvery{5};
  std::unique_lock lock(mutex_);
  while (!changed_.wait_for(lock, kLookEvery, [&] { return done_; })) {
    std::ifstream table("/proc/self/statm");
    std::uint64_t size = 0, resident = 0, shared = 0;  // `shared` are the pages of files
    table >> size >> resident >> shared;
    if (shared * std::uint64_t(::sysconf(_SC_PAGESIZE)) <= options_.maxResidentBytes) continue;
    // All files are removed from the memory of the process. Their content remains in the cache of the
    // system as long as there is room, and on the disk.
    for (const auto& [array, bytes] : mapped_) ::madvise(array, bytes, MADV_DONTNEED);
  }
}

VoxelMemory::VoxelMemory(const Files& files) : files_(std::make_shared<VoxelFiles>(files)) {}

bool VoxelMemory::isInFile(std::uint64_t bytes) const {
  return files_ && bytes > (isForAllSizes_ ? 0 : files_->options().maxHeapBytes);
}

VoxelMemory VoxelMemory::forAllSizes() const {
  VoxelMemory memory = *this;
  memory.isForAllSizes_ = true;
  return memory;
}

void VoxelMemory::requireRoom(double bytes, const std::string& what) const {
  if (!files_) return;
  std::error_code unknown;
  const auto space = std::filesystem::space(files_->options().folder, unknown);
  if (unknown || bytes <= double(space.available)) return;
  throw MemoryExceeded(what + " asks for up to " + byteText(bytes) + " of files in " +
                       files_->options().folder.string() + ", which has " +
                       byteText(double(space.available)) + " free");
}

namespace {

/// Arrays from this size on ask for large pages: a first access to each of many small pages takes longer than the
/// writing (a copy of 100 MB takes 27 instead of 75 ms).
constexpr std::size_t kLargePage = std::size_t{1} << 21, kLargeArray = 4 * kLargePage;

void* inLargePages(std::size_t bytes) {
  const std::size_t whole = (bytes + kLargePage - 1) / kLargePage * kLargePage;
  void* const array = whole < bytes ? nullptr : std::aligned_alloc(kLargePage, whole);
  if (!array) throw std::bad_alloc();
  (void)::madvise(array, whole, MADV_HUGEPAGE);  // a hint, which a system may not know
  return array;
}

}  // namespace

void* VoxelMemory::allocate(std::size_t bytes) const {
  if (isInFile(bytes)) return files_->map(bytes);
  return bytes >= kLargeArray ? inLargePages(bytes) : ::operator new(bytes);
}

void VoxelMemory::deallocate(void* array, std::size_t bytes) const noexcept {
  if (isInFile(bytes))
    files_->unmap(array, bytes);
  else if (bytes >= kLargeArray)
    std::free(array);
  else
    ::operator delete(array);
}

}  // namespace esvr
