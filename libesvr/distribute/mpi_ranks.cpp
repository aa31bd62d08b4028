// The module esvr_mpi.so: ranks that talk to each other by MPI.

#include <mpi.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <mutex>
#include <thread>
#include <utility>

#include "esvr/error.h"
#include "esvr/workers.h"

namespace esvr {
namespace {

constexpr std::chrono::milliseconds kPause{1};
constexpr int kAsk = 1, kAnswer = 2, kEnded = 3;  // tags of messages
constexpr std::int64_t kNoneLeft = -1;
constexpr std::uint64_t kEnd = 0x454E4420'4F464649;  // number on which ranks that end agree

/// Waits without using the processor, unlike the calls of MPI that block.
void waitFor(MPI_Request request) {
  int done = 0;
  while (MPI_Test(&request, &done, MPI_STATUS_IGNORE), !done) std::this_thread::sleep_for(kPause);
}

/// Hands out numbers to the ranks. Rank 0 takes its own numbers directly; a thread of it answers the
/// others.
class Dispatcher {
 public:
  Dispatcher(std::size_t count, int others)
      : count_(count), thread_([this, others] { answer(others); }) {}

  std::int64_t next() {
    const std::size_t number = next_++;
    return number < count_ ? std::int64_t(number) : kNoneLeft;
  }

 private:
  /// Answers until every other rank knows that none is left.
  void answer(int others) {
    while (others > 0) {
      int asked = 0;
      MPI_Status status;
      MPI_Iprobe(MPI_ANY_SOURCE, kAsk, MPI_COMM_WORLD, &asked, &status);
      if (!asked) {
        std::this_thread::sleep_for(kPause);
        continue;
      }
      MPI_Recv(nullptr, 0, MPI_BYTE, status.MPI_SOURCE, kAsk, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
      const std::int64_t number = next();
      MPI_Send(&number, 1, MPI_INT64_T, status.MPI_SOURCE, kAnswer, MPI_COMM_WORLD);
      if (number == kNoneLeft) --others;
    }
  }

  const std::size_t count_;
  std::atomic<std::size_t> next_{0};
  std::jthread thread_;
};

class MpiRanks : public Ranks {
 public:
  MpiRanks() {
    int support = 0;
    MPI_Init_thread(nullptr, nullptr, MPI_THREAD_SERIALIZED, &support);
    if (support < MPI_THREAD_SERIALIZED)
      throw RuntimeFailure("this MPI cannot be used by programs with threads");
    MPI_Comm_rank(MPI_COMM_WORLD, &rank_);
    MPI_Comm_size(MPI_COMM_WORLD, &count_);
    MPI_Comm host;
    MPI_Comm_split_type(MPI_COMM_WORLD, MPI_COMM_TYPE_SHARED, rank_, MPI_INFO_NULL, &host);
    MPI_Comm_rank(host, &rankOnHost_);
    MPI_Comm_free(&host);
  }
  ~MpiRanks() override {
    if (!haveAllEnded_) (void)agree(kEnd);  // a rank that does not end yet sees that this one does
    MPI_Finalize();
  }
  MpiRanks(const MpiRanks&) = delete;
  MpiRanks& operator=(const MpiRanks&) = delete;

  [[nodiscard]] int rank() const override { return rank_; }
  [[nodiscard]] int count() const override { return count_; }
  [[nodiscard]] int rankOnHost() const override { return rankOnHost_; }

  bool agree(std::uint64_t number) override {
    waitForAll();
    std::uint64_t least = 0, most = 0;
    MPI_Allreduce(&number, &least, 1, MPI_UINT64_T, MPI_MIN, MPI_COMM_WORLD);
    MPI_Allreduce(&number, &most, 1, MPI_UINT64_T, MPI_MAX, MPI_COMM_WORLD);
    return least == most;
  }

  void handOut(std::size_t count) override {
    isNoneLeft_ = false;
    if (rank_ == 0) dispatcher_ = std::make_unique<Dispatcher>(count, count_ - 1);
  }

  std::optional<std::size_t> next() override {
    const std::lock_guard lock(mutex_);
    if (isNoneLeft_) return std::nullopt;  // rank 0 answers this once
    const std::int64_t number = dispatcher_ ? dispatcher_->next() : ask();
    isNoneLeft_ = number == kNoneLeft;
    return isNoneLeft_ ? std::nullopt : std::optional<std::size_t>(number);
  }

  std::vector<Bytes> exchange(std::vector<std::optional<Bytes>> own) override {
    dispatcher_.reset();
    waitForAll();
    const std::vector<int> owners = ownersOf(own);
    std::vector<Bytes> all(own.size());
    for (std::size_t n = 0; n < all.size(); ++n) {
      if (own[n]) all[n] = std::move(*own[n]);
      broadcast(all[n], owners[n]);
    }
    return all;
  }

  bool allEnd(double seconds) override {
    if (dispatcher_) return false;  // its thread uses MPI, and other ranks still ask it for numbers
    const auto until = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
    std::vector<MPI_Request> requests;
    for (int other = 0; other < count_; ++other) {
      if (other == rank_) continue;
      MPI_Isend(nullptr, 0, MPI_BYTE, other, kEnded, MPI_COMM_WORLD, &requests.emplace_back());
      MPI_Irecv(nullptr, 0, MPI_BYTE, other, kEnded, MPI_COMM_WORLD, &requests.emplace_back());
    }
    for (int done = 0; !done; std::this_thread::sleep_for(kPause)) {
      MPI_Testall(int(requests.size()), requests.data(), &done, MPI_STATUSES_IGNORE);
      if (!done && std::chrono::steady_clock::now() > until) return false;
    }
    haveAllEnded_ = true;
    return true;
  }

  void abort(int exitCode) override {
    MPI_Abort(MPI_COMM_WORLD, exitCode);
    std::abort();  // MPI_Abort does not return
  }

 private:
  static void waitForAll() {
    MPI_Request request;
    MPI_Ibarrier(MPI_COMM_WORLD, &request);
    waitFor(request);
  }

  static std::int64_t ask() {
    std::int64_t number = 0;
    MPI_Request request;
    MPI_Irecv(&number, 1, MPI_INT64_T, 0, kAnswer, MPI_COMM_WORLD, &request);
    MPI_Send(nullptr, 0, MPI_BYTE, 0, kAsk, MPI_COMM_WORLD);
    waitFor(request);
    return number;
  }

  /// The rank that has each result.
  [[nodiscard]] std::vector<int> ownersOf(const std::vector<std::optional<Bytes>>& own) const {
    std::vector<int> owners;
    for (const auto& result : own) owners.push_back(result ? rank_ : -1);
    MPI_Allreduce(MPI_IN_PLACE, owners.data(), int(owners.size()), MPI_INT, MPI_MAX,
                  MPI_COMM_WORLD);
    return owners;
  }

  /// Sends bytes from one rank to all, in pieces whose sizes an int can hold.
  static void broadcast(Bytes& bytes, int from) {
    constexpr std::uint64_t kPiece = std::uint64_t{1} << 30;
    std::uint64_t size = bytes.size();
    MPI_Bcast(&size, 1, MPI_UINT64_T, from, MPI_COMM_WORLD);
    bytes.resize(size);
    for (std::uint64_t at = 0; at < size; at += kPiece)
      MPI_Bcast(bytes.data() + at, int(std::min(kPiece, size - at)), MPI_BYTE, from,
                MPI_COMM_WORLD);
  }

  int rank_ = 0, count_ = 1, rankOnHost_ = 0;
  std::mutex mutex_;
  bool isNoneLeft_ = true, haveAllEnded_ = false;
  std::unique_ptr<Dispatcher> dispatcher_;  ///< on rank 0, while numbers are handed out
};

}  // namespace
}  // namespace esvr

extern "C" esvr::Ranks* esvrJoinMpi() { return new esvr::MpiRanks; }
