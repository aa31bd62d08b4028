#pragma once
/// Cairo surfaces with ownership and error checks.

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

/// \throws RuntimeFailure  cairo reports an error (the text is cairo's)
void check(cairo_status_t status);

/// Encodes a surface as PNG. \throws RuntimeFailure  cairo reports an error
[[nodiscard]] std::string pngBytes(const Surface& surface);

/// A write callback for cairo, which appends to the std::string that `closure` points to.
cairo_status_t appendBytes(void* closure, const unsigned char* data, unsigned int length);

}  // namespace esvr::report
