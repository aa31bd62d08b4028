#include <chrono>
#include <deque>
#include <mutex>
#include <thread>
#include <utility>

#include "distribute/on_devices.h"
#include "esvr/error.h"
#include "esvr/part_store.h"

namespace esvr {
namespace {

constexpr std::chrono::milliseconds kPollInterval{50};

/// The parts of a round that have no result yet. All functions may be called on any thread.
class Queue {
 public:
  /// \param first  the part to begin with
  Queue(std::size_t count, std::size_t first) {
    for (std::size_t n = 0; n < count; ++n) waiting_.push_back((first + n) % count);
  }

  /// The next part. Parts that another process fits come last and after a pause.
  /// \return nothing if there is none
  std::optional<std::size_t> next() {
    const std::lock_guard lock(mutex_);
    if (waiting_.empty()) std::swap(waiting_, elsewhere_);
    if (waiting_.empty()) return std::nullopt;
    const std::size_t part = waiting_.front();
    waiting_.pop_front();
    return part;
  }
  /// Returns a part that another process fits.
  void postpone(std::size_t part) {
    {
      const std::lock_guard lock(mutex_);
      elsewhere_.push_back(part);
      if (!waiting_.empty()) return;
    }
    std::this_thread::sleep_for(kPollInterval);
  }
  void clear() {
    const std::lock_guard lock(mutex_);
    waiting_.clear();
    elsewhere_.clear();
  }

 private:
  std::mutex mutex_;
  std::deque<std::size_t> waiting_, elsewhere_;
};

/// Gets the results of a round.
class StoredRound {
 public:
  StoredRound(PartStore& store, const StoredPartsOptions& options, const RoundParts& parts)
      : store_(store),
        options_(options),
        parts_(parts),
        results_(parts.count()),
        queue_(parts.count(), firstOf(options.share, parts.count())),
        working_(options.devices, options.onLost) {}

  std::vector<std::vector<std::byte>> run() {
    const auto work = [this](const Device& device) {
      while (const auto part = queue_.next())
        if (!findOrFit(*part, device)) queue_.postpone(*part);
    };
    onDevices(options_.devices, work, [this] { queue_.clear(); });
    return std::move(results_);
  }

 private:
  static std::size_t firstOf(const PartShare& share, std::size_t parts) {
    return parts * std::size_t(share.number - 1) / std::size_t(share.count);
  }
  [[nodiscard]] bool cancelled() const { return options_.cancel && options_.cancel->cancelled(); }

  /// \return false if another process fits the part
  bool findOrFit(std::size_t part, const Device& device) {
    const PartKey key = parts_.keyOf(part);
    if (take(part, key)) return true;
    const auto claim = store_.claim(key);
    if (!claim && !cancelled()) return false;
    if (!take(part, key)) fit(part, key, device);  // it may have been ended before the claim
    return true;
  }
  bool take(std::size_t part, const PartKey& key) {
    auto found = store_.find(key);
    if (found) results_[part] = std::move(*found);
    return found.has_value();
  }
  void fit(std::size_t part, const PartKey& key, const Device& device) {
    PartOutput output = working_.fit(parts_, part, device);
    if (output.complete) store_.put(key, output.bytes);
    results_[part] = std::move(output.bytes);
  }

  PartStore& store_;
  const StoredPartsOptions& options_;
  const RoundParts& parts_;
  std::vector<std::vector<std::byte>> results_;
  Queue queue_;
  WorkingDevices working_;
};

}  // namespace

StoredParts::StoredParts(PartStore& store, StoredPartsOptions options)
    : store_(store), options_(std::move(options)) {}

void StoredParts::requireAll(const RoundParts& parts) const {
  std::size_t missing = 0;
  for (std::size_t p = 0; p < parts.count(); ++p) missing += !store_.contains(parts.keyOf(p));
  if (missing > 0)
    throw BadInput(store_.folder().string() + " is not complete: " + std::to_string(missing) +
                   " of the " + std::to_string(parts.count()) + " parts of round " +
                   std::to_string(parts.round() + 1) + " are missing");
}

std::vector<std::vector<std::byte>> StoredParts::run(const RoundParts& parts) {
  if (options_.mergeOnly) requireAll(parts);
  return StoredRound(store_, options_, parts).run();
}

}  // namespace esvr
