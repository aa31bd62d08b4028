#include "core/byte_text.h"

#include <cstdio>

namespace esvr {

std::string byteText(double bytes) {
  constexpr double kMega = 1e6, kGiga = 1e9;
  char text[32];
  if (bytes < kGiga)
    std::snprintf(text, sizeof text, "%.3g MB", bytes / kMega);
  else
    std::snprintf(text, sizeof text, "%.3g GB", bytes / kGiga);
  return text;
}

}  // namespace esvr
