#include "metrics/shown_pictures.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "esvr/error.h"

namespace esvr::metrics {
namespace {

std::string sizeOf(const Image& image) {
  return std::to_string(image.width) + " x " + std::to_string(image.height);
}

}  // namespace

void requireEqualSizes(const Image& reference, const Image& candidate) {
  if (reference.width < 1 || reference.height < 1)
    throw UsageError("a picture of " + sizeOf(reference) + " pixels cannot be compared");
  if (reference.width != candidate.width || reference.height != candidate.height)
    throw UsageError("pictures of " + sizeOf(reference) + " and " + sizeOf(candidate) +
                     " pixels cannot be compared");
}

double shownValue(float value) {
  if (std::isnan(value)) throw BadInput("a picture has a color that is not a number");
  return std::clamp(double(value), 0.0, 1.0);
}

}  // namespace esvr::metrics
