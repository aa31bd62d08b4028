#include "render/view/service.h"

#include "render/view/page.h"

namespace esvr::view {

Service::Service(const Collection& collection, const Settings& settings)
    : io_(1),
      studio_(collection, settings.drawing),
      desk_(collection, studio_, deviceName(settings.drawing.device)),
      context_{settings.site,
               viewPage(),
               {desk_, studio_, settings.limits},
               Seats(settings.limits.clients)},
      server_(io_, settings.at, context_) {
  server_.run();
}

// Connections may outlive this call in handlers of the context, but the studio no longer sends.
Service::~Service() { studio_.stop(); }

}  // namespace esvr::view
