#include "core/voxel_files.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <fstream>
#include <string>
#include <system_error>

#include "core/byte_text.h"
#include "core/publish_file.h"
#include "core/temporary_files.h"
#include "esvr/error.h"

namespace esvr {
namespace {

namespace fs = std::filesystem;

/// Time between two looks at the memory in use. A look takes 20 microseconds; a program that scans
/// voxels on all cores reaches some 100 MB between two looks.
constexpr std::chrono::milliseconds kLookEvery{5};

[[noreturn]] void fail(const fs::path& folder, std::size_t bytes, int error) {
  throw RuntimeFailure("cannot keep " + byteText(double(bytes)) + " of voxels in a file in " +
                       folder.string() + ": " + std::system_category().message(error));
}

/// Reserves the bytes on the disk. \return 0 or the number of the error
int reserve(int fd, std::size_t bytes) {
  for (;;)
    if (const int error = ::posix_fallocate(fd, 0, off_t(bytes)); error != EINTR) return error;
}

/// The bytes of files that are in the memory of the process.
std::uint64_t residentFileBytes() {
  std::ifstream table("/proc/self/statm");
  std::uint64_t size = 0, resident = 0, shared = 0;
  table >> size >> resident >> shared;
  return shared * std::uint64_t(::sysconf(_SC_PAGESIZE));
}

}  // namespace

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
  const int fd = createNameless(options_.folder);
  if (fd < 0) fail(options_.folder, bytes, errno);
  int error = reserve(fd, bytes);
  void* const array =
      error == 0 ? ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0) : MAP_FAILED;
  if (error == 0 && array == MAP_FAILED) error = errno;
  ::close(fd);
  if (error != 0) fail(options_.folder, bytes, error);
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
  std::unique_lock lock(mutex_);
  while (!changed_.wait_for(lock, kLookEvery, [&] { return done_; }))
    if (residentFileBytes() > options_.maxResidentBytes) giveBack();
}

/// Removes all files from the memory of the process. Their content remains in the cache of the
/// system as long as there is room, and on the disk.
void VoxelFiles::giveBack() {
  for (const auto& [array, bytes] : mapped_) ::madvise(array, bytes, MADV_DONTNEED);
}

}  // namespace esvr
