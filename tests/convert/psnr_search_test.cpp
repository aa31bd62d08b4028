// Plan: the search for a PSNR continues a fit that has too few ellipsoids, instead of beginning
// again with seeds. A search that is cancelled during its first fit keeps this fit. A search whose
// short fits were made before finds the same; a token of their own cancels them only.

#include "convert/psnr_search.h"

#include <gtest/gtest.h>

#include "convert/volumes.h"
#include "esvr/error.h"
#include "esvr/grid_coding.h"

namespace esvr {
namespace {

constexpr std::uint32_t kWholeFit = 400, kContinuedFit = 100;

convert::PsnrResult search(double psnr, ConvertOptions options) {
  const GridDescriptor descriptor;
  const SparseVolume volume = test::tubeVolume();
  const ConvertInput input{descriptor, volume};
  return convert::searchPsnr({input, options}, psnr);
}

/// The iterations of the fit that a search takes.
std::uint32_t iterationsFor(double psnr) {
  ConvertOptions options;
  options.fit.iterations = kWholeFit;
  options.fit.kappa = 2.0f;
  const auto found = search(psnr, options);
  EXPECT_EQ(found.conversion->fit.end, FitEnd::kPsnrReached);
  return found.conversion->fit.curve.back().iteration;
}

TEST(PsnrSearch, SlowContinuesAFitWithTooFewEllipsoids) {
  bool whole = false, continued = false;
  for (const double psnr : {28.0, 30.0, 32.0, 34.0, 36.0, 38.0}) {
    const std::uint32_t iterations = iterationsFor(psnr);
    whole |= iterations == kWholeFit;
    continued |= iterations == kContinuedFit;
  }
  EXPECT_TRUE(whole);
  EXPECT_TRUE(continued);
}

TEST(PsnrSearch, KeepsItsFirstFitWhereItIsCancelled) {
  CancelToken cancel;
  ConvertOptions options;
  options.fit.iterations = 1'000'000;
  options.fit.cancel = &cancel;
  options.fit.progress = [&](const FitProgress&) { cancel.cancel(); };
  const auto found = search(60.0, options);
  ASSERT_TRUE(found.conversion);
  EXPECT_EQ(found.conversion->fit.end, FitEnd::kCancelled);
  EXPECT_GT(found.conversion->grid.field.ellipsoidCount(), 0u);
}

ConvertOptions shortOptions() {
  ConvertOptions options;
  options.fit.iterations = 80;
  options.fit.kappa = 2.0f;
  return options;
}

TEST(StartPsnrSearch, FindsWhatTheWholeSearchFinds) {
  constexpr double kPsnr = 30.0;
  const GridDescriptor descriptor;
  const SparseVolume volume = test::tubeVolume();
  const ConvertInput input{descriptor, volume};
  const ConvertOptions options = shortOptions();
  convert::RestOfSearch rest;
  {
    const CancelToken cancel;  // ends with the short fits
    rest = convert::startPsnrSearch({input, options}, kPsnr, cancel);
  }
  const auto found = rest({});
  const auto whole = search(kPsnr, options);
  ASSERT_TRUE(found.conversion && whole.conversion);
  EXPECT_EQ(found.conversion->grid.field.ellipsoidCount(),
            whole.conversion->grid.field.ellipsoidCount());
  EXPECT_EQ(bytesAdded(found.conversion->grid), bytesAdded(whole.conversion->grid));
}

TEST(StartPsnrSearch, EndsWhereItsShortFitsAreCancelled) {
  const GridDescriptor descriptor;
  const SparseVolume volume = test::tubeVolume();
  const ConvertOptions options = shortOptions();
  CancelToken cancel;
  cancel.cancel();
  EXPECT_THROW((void)convert::startPsnrSearch({{descriptor, volume}, options}, 30.0, cancel),
               Cancelled);
}

}  // namespace
}  // namespace esvr
