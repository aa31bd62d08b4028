#include "vdb2esvr/parts.h"

#include <algorithm>
#include <iterator>
#include <nlohmann/json.hpp>
#include <system_error>
#include <utility>

#include "cli/version_text.h"
#include "esvr/device_workers.h"
#include "esvr/error.h"
#include "esvr/rank_workers.h"
#include "vdb2esvr/asked_report.h"

namespace esvr::vdb2esvr {
namespace {

namespace fs = std::filesystem;

/// The properties of the input file that change with its content.
void addInput(const fs::path& input, std::vector<PartOrigin>& origin) {
  std::error_code error;
  const fs::path path = fs::canonical(input, error);
  if (error) throw BadInput("cannot read " + input.string() + ": " + error.message());
  const auto changed = fs::last_write_time(path).time_since_epoch().count();
  origin.push_back({"input", path.string()});
  origin.push_back({"input's size", std::to_string(fs::file_size(path))});
  origin.push_back({"input's time of change", std::to_string(changed)});
}

std::vector<PartOrigin> originOf(const Options& options, const Device& device) {
  std::vector<PartOrigin> origin{{"version", cli::programVersion()}};
  addInput(options.input, origin);
  const auto asked = askedJson(options);
  for (const auto& [name, value] : asked.items())
    if (name != "threads" && name != "device") origin.push_back({name, value.dump()});
  std::string grids;
  for (const auto& grid : options.grids.only) grids += '"' + grid + '"';
  origin.push_back({"grids", grids});
  origin.push_back({"kind of device", device.kind == DeviceKind::kCpu ? "CPU" : "GPU"});
  return origin;
}

/// Each GPU twice: while it fits a part, the next one is prepared on the host.
std::vector<Device> withPreparation(const std::vector<Device>& devices) {
  std::vector<Device> workers = devices;
  std::ranges::copy_if(devices, std::back_inserter(workers),
                       [](const Device& device) { return device.kind == DeviceKind::kCuda; });
  return workers;
}

}  // namespace

fs::path partsFolder(const Options& options) { return options.output.string() + ".parts"; }

Parts::Parts(const Options& options, const Device& device, Ranks* ranks) : ranks_(ranks) {
  if (!options.resume) return;
  store_.emplace(partsFolder(options), originOf(options, device),
                 ranks ? PartStore::Access::kShared : PartStore::Access::kAlone);
}

PartRunner* Parts::runOn(const std::vector<Device>& devices, LostDevice onLost) {
  PartStore* const store = store_ ? &*store_ : nullptr;
  if (ranks_)
    runner_ = std::make_unique<RankWorkers>(*ranks_, devices, store);
  else
    runner_ = std::make_unique<DeviceWorkers>(withPreparation(devices), std::move(onLost), store);
  return runner_.get();
}

void Parts::remove() {
  if (store_) store_->remove();
}

}  // namespace esvr::vdb2esvr
