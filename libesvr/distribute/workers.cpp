// Runs the parts of a fit in chunks on the devices of this process, or on those of several ranks. In both
// cases, every device has a thread that takes one part after the other.

#include <dlfcn.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <exception>
#include <functional>
#include <future>
#include <mutex>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/parse_text.h"
#include "esvr/device.h"
#include "esvr/error.h"
#include "esvr/workers.h"

namespace esvr {
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
