#include "render/view/service.h"

#include <tbb/global_control.h>

#include "render/view/page.h"

namespace esvr::view {
namespace {

std::string deviceText(const Device& device) {
  if (device.kind != DeviceKind::kCpu) return deviceName(device);
  using Control = tbb::global_control;
  const std::size_t threads = Control::active_value(Control::max_allowed_parallelism);
  return deviceName(device) + ", " + std::to_string(threads) + " thread" +
         (threads == 1 ? "" : "s");
}

}  // namespace

Service::Service(const Collection& collection, const Settings& settings)
    : io_(1),
      studio_(collection, settings.drawing),
      desk_(collection, studio_, deviceText(settings.drawing.device)),
      context_{settings.site,
               viewPage(),
               {desk_, studio_, settings.limits},
               Seats(settings.limits.clients),
               Seats(settings.limits.requests)},
      server_(io_, settings.at, context_) {
  server_.run();
}

// Connections may outlive this call in handlers of the context, but the studio no longer sends.
Service::~Service() { studio_.stop(); }

bool Service::endsWithin(std::chrono::milliseconds time) {
  stop();
  return studio_.endsWithin(time);
}

}  // namespace esvr::view
