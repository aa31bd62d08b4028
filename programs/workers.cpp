// The threads of a program: the option --threads, tasks on several threads, and the order of their
// results.
#include "programs/workers.h"

#include <tbb/global_control.h>
#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>

namespace esvr::cli {

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
