#include "esvr/device.h"

#include <algorithm>
#include <optional>
#include <string_view>

#include "core/device_choice.h"
#include "core/parse_text.h"
#include "esvr/did_you_mean.h"
#include "esvr/error.h"

namespace esvr {
namespace {

constexpr std::string_view kCudaPrefix = "cuda:", kAllDevices = "cuda:all";

/// The number of a device; nothing for any other text.
std::optional<int> indexOf(std::string_view text) {
  const auto index = parseWhole(text);
  if (!index || *index < 0 || *index > std::numeric_limits<int>::max()) return std::nullopt;
  return int(*index);
}

const CudaDevice* firstUsable(const CudaProbe& probe) {
  const auto it = std::find_if(probe.devices.begin(), probe.devices.end(),
                               [](const CudaDevice& d) { return d.whyNotUsable.empty(); });
  return it == probe.devices.end() ? nullptr : &*it;
}

Device requireUsable(const CudaProbe& probe) {
  if (const auto* device = firstUsable(probe)) return {DeviceKind::kCuda, device->index};
  std::string text = "no CUDA device";
  if (!probe.whyNoDevices.empty()) text += ": " + probe.whyNoDevices;
  for (const auto& d : probe.devices)
    text += "; cuda:" + std::to_string(d.index) + " (" + d.name + "): " + d.whyNotUsable;
  throw DeviceError(text);
}

Device requireIndex(const CudaProbe& probe, int index) {
  const std::string name = std::string(kCudaPrefix) + std::to_string(index);
  if (!probe.whyNoDevices.empty()) throw DeviceError("no " + name + ": " + probe.whyNoDevices);
  for (const auto& device : probe.devices) {
    if (device.index != index) continue;
    if (!device.whyNotUsable.empty())
      throw DeviceError(name + " (" + device.name + "): " + device.whyNotUsable);
    return {DeviceKind::kCuda, index};
  }
  throw DeviceError("no " + name + ": there are " + std::to_string(probe.devices.size()) +
                    " CUDA devices, counted from 0");
}

std::vector<Device> allUsable(const CudaProbe& probe) {
  std::vector<Device> devices{requireUsable(probe)};
  for (const auto& device : probe.devices)
    if (device.whyNotUsable.empty() && device.index != devices.front().index)
      devices.push_back({DeviceKind::kCuda, device.index});
  return devices;
}

/// The numbers of "cuda:N,M,..."; none if the text is another one.
std::vector<int> cudaIndices(const std::string& text) {
  std::vector<int> indices;
  if (!text.starts_with(kCudaPrefix)) return indices;
  for (const auto& number : splitText(text.substr(kCudaPrefix.size()), ',')) {
    const auto index = indexOf(number);
    if (!index) return {};
    indices.push_back(*index);
  }
  return indices;
}

/// The devices of this machine. With "cpu" the driver is not initialised.
CudaProbe probeFor(const std::string& text) { return text == "cpu" ? CudaProbe{} : probeCuda(); }

}  // namespace

Device chooseDevice(const std::string& text, const CudaProbe& probe) {
  if (text == "cpu") return {};
  if (text == "cuda") return requireUsable(probe);
  if (text == "auto") return firstUsable(probe) ? requireUsable(probe) : Device{};
  if (const auto indices = cudaIndices(text); indices.size() == 1)
    return requireIndex(probe, indices.front());
  const std::vector<std::string> known{"auto", "cpu", "cuda"};
  throw UsageError("device '" + text + "' is none of auto, cpu, cuda, cuda:N" +
                   didYouMean(text, known));
}

std::vector<Device> chooseDevices(const std::string& text, const CudaProbe& probe) {
  if (text == kAllDevices) return allUsable(probe);
  std::vector<Device> devices;
  for (const int index : cudaIndices(text)) devices.push_back(requireIndex(probe, index));
  if (devices.empty()) devices.push_back(chooseDevice(text, probe));
  return devices;
}

Device selectDevice(const std::string& text) { return chooseDevice(text, probeFor(text)); }

std::vector<Device> selectDevices(const std::string& text) {
  return chooseDevices(text, probeFor(text));
}

std::string deviceName(const Device& device) {
  if (device.kind == DeviceKind::kCpu) return "CPU";
  const std::string place = std::string(kCudaPrefix) + std::to_string(device.index);
  for (const auto& found : probeCuda().devices)
    if (found.index == device.index) return found.name + " (" + place + ")";
  return place;
}

std::string cudaVersions() { return probeCuda().versions; }

// Cancellation.

namespace {

thread_local const CancelToken* tokenOfThread = nullptr;

}  // namespace

CancelScope::CancelScope(const CancelToken* token) noexcept : outer_(tokenOfThread) {
  tokenOfThread = token;
}
CancelScope::~CancelScope() { tokenOfThread = outer_; }

const CancelToken* CancelScope::token() noexcept { return tokenOfThread; }

void CancelScope::check() {
  if (cancelled()) throw Cancelled();
}

}  // namespace esvr
