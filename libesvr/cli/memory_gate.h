#pragma once
/// Lets tasks on several threads begin only while there is memory for them.

#include <condition_variable>
#include <cstdint>
#include <mutex>

namespace esvr::cli {

/// An amount of memory that tasks share. They take their parts in the order in which they ask, so
/// that a large task does not wait forever.
class MemoryGate {
 public:
  explicit MemoryGate(std::uint64_t bytes) : all_(bytes) {}

  /// The memory of a task. It is given back when the object goes out of scope.
  class Part {
   public:
    Part(MemoryGate& gate, std::uint64_t bytes) : gate_(gate), bytes_(bytes) {}
    ~Part() { gate_.giveBack(bytes_); }
    Part(const Part&) = delete;
    Part& operator=(const Part&) = delete;

   private:
    MemoryGate& gate_;
    std::uint64_t bytes_;
  };

  /// Waits until there is enough memory. A task that needs more than there is runs alone.
  [[nodiscard]] Part take(std::uint64_t bytes);
  [[nodiscard]] Part takeAll() { return take(all_); }

 private:
  void giveBack(std::uint64_t bytes);

  const std::uint64_t all_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::uint64_t taken_ = 0;
  std::uint64_t nextTicket_ = 0, served_ = 0;
};

}  // namespace esvr::cli
