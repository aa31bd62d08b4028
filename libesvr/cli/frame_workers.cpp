#include "cli/frame_workers.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>

namespace esvr::cli {
namespace {

class FrameWorkers {
 public:
  FrameWorkers(const FrameRun& run, const std::function<bool(const FrameTask&)>& job)
      : run_(run), job_(job) {}

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
    for (std::size_t i; !stopped() && (i = next_++) < run_.frames.size();)
      if (!run_.frames[i].missing && !job_({i, worker}) && run_.onError == OnFrameError::kStop)
        stop_ = true;
  } catch (...) {
    const std::lock_guard lock(mutex_);
    if (!error_) error_ = std::current_exception();
    stop_ = true;
  }

  [[nodiscard]] bool stopped() const { return stop_ || run_.cancel.cancelled(); }

  const FrameRun& run_;
  const std::function<bool(const FrameTask&)>& job_;
  std::atomic<std::size_t> next_{0};
  std::atomic<bool> stop_{false};
  std::mutex mutex_;
  std::exception_ptr error_;
};

}  // namespace

void forEachFrame(const FrameRun& run, const std::function<bool(const FrameTask&)>& job) {
  FrameWorkers(run, job).run();
}

int frameWorkers(int threads, const std::vector<Frame>& frames) {
  const int all = threads > 0 ? threads : int(std::max(std::thread::hardware_concurrency(), 1u));
  const auto inputs =
      std::ranges::count_if(frames, [](const Frame& frame) { return !frame.missing; });
  return int(std::clamp<std::ptrdiff_t>(inputs, 1, all));
}

}  // namespace esvr::cli
