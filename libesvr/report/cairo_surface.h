#pragma once
/// Cairo's surfaces, owned and checked.

#include <cairo.h>

#include <memory>
#include <string>

namespace esvr::report {

struct FreeSurface {
  void operator()(cairo_surface_t* surface) const { cairo_surface_destroy(surface); }
};
using Surface = std::unique_ptr<cairo_surface_t, FreeSurface>;

struct FreeContext {
  void operator()(cairo_t* context) const { cairo_destroy(context); }
};
using Context = std::unique_ptr<cairo_t, FreeContext>;

/// \throws RuntimeFailure  cairo's own words
void check(cairo_status_t status);

/// The surface as a PNG file's bytes. \throws RuntimeFailure
[[nodiscard]] std::string pngBytes(const Surface& surface);

/// Appends to the std::string that `closure` points to: cairo's way of writing.
cairo_status_t appendBytes(void* closure, const unsigned char* data, unsigned int length);

}  // namespace esvr::report
