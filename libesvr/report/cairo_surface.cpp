#include "report/cairo_surface.h"

#include "esvr/error.h"

namespace esvr::report {

void check(cairo_status_t status) {
  if (status != CAIRO_STATUS_SUCCESS)
    throw RuntimeFailure(std::string("cairo: ") + cairo_status_to_string(status));
}

cairo_status_t appendBytes(void* closure, const unsigned char* data, unsigned int length) {
  static_cast<std::string*>(closure)->append(reinterpret_cast<const char*>(data), length);
  return CAIRO_STATUS_SUCCESS;
}

std::string pngBytes(const Surface& surface) {
  std::string bytes;
  check(cairo_surface_write_to_png_stream(surface.get(), appendBytes, &bytes));
  return bytes;
}

}  // namespace esvr::report
