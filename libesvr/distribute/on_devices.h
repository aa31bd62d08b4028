#pragma once
/// Runs work on several devices.

#include <functional>
#include <span>

#include "esvr/device.h"

namespace esvr {

/// Calls work(device) for every device, each on its own thread, and waits for all calls.
/// \param stop  is called if a call fails, so that the others can end early
/// \throws Error  what the first call that failed threw, in the order of the devices
void onDevices(std::span<const Device> devices, const std::function<void(const Device&)>& work,
               const std::function<void()>& stop);

}  // namespace esvr
