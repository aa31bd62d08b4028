#include "esvr/paper_method.h"

#include <algorithm>
#include <cmath>

namespace esvr {

PaperMethod scaledTo(const PaperMethod& method, std::uint32_t epochs) {
  const double factor = double(epochs) / double(method.epochs);
  const auto scaled = [&](std::uint32_t epoch) {
    return std::uint32_t(std::max(1.0, std::round(double(epoch) * factor)));
  };
  PaperMethod result = method;
  result.epochs = epochs;
  result.densifyFrom = scaled(method.densifyFrom);
  result.densifyUntil = scaled(method.densifyUntil);
  result.densifyEvery = scaled(method.densifyEvery);
  for (PrunePass& pass : result.prunes) pass.epoch = scaled(pass.epoch);
  return result;
}

PaperMethod withThreePasses(PaperMethod method) {
  method.epochs = 1600;
  method.prunes = {{200, 0.8}, {300, 0.8}, {800, 0.85}};
  return method;
}

}  // namespace esvr
