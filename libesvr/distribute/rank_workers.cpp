#include "esvr/rank_workers.h"

#include <atomic>
#include <utility>

#include "distribute/on_devices.h"
#include "esvr/error.h"

namespace esvr {

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

}  // namespace esvr
