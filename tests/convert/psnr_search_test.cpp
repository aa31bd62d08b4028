// Plan: the search for a PSNR continues a fit that has too few ellipsoids, instead of beginning
// again with seeds. A search that is cancelled during its first fit keeps this fit. A search whose
// short fits are made before the number of bytes is known finds the same ellipsoids, and none if
// too few bytes are left. A token of their own cancels these short fits.

#include "convert/psnr_search.h"

#include <gtest/gtest.h>

#include "convert/volumes.h"
#include "esvr/error.h"

namespace esvr {
namespace {

constexpr std::uint32_t kWholeFit = 400, kContinuedFit = 160;

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

TEST(PsnrSearch, SlowContinuesAFitOfAboutAsManyEllipsoids) {
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
  options.fit.iterations = 60;
  return options;
}

TEST(StartPsnrSearch, FindsWhatTheWholeSearchFinds) {
  constexpr double kPsnr = 28.0;
  const GridDescriptor descriptor;
  const SparseVolume volume = test::tubeVolume();
  const ConvertInput input{descriptor, volume};
  const ConvertOptions options = shortOptions();
  const auto rest = [&] {
    const CancelToken cancel;  // ends with the short fits
    return convert::startPsnrSearch({input, options}, kPsnr, cancel);
  };
  const auto whole = convert::searchPsnr({input, options}, kPsnr).conversion;
  const auto parted = rest()({}).conversion;
  ASSERT_TRUE(whole && parted);
  EXPECT_EQ(parted->grid.quantised, whole->grid.quantised);
  const auto limited = rest()(100);
  EXPECT_FALSE(limited.conversion);
  EXPECT_GT(limited.expected, 100u);
}

TEST(StartPsnrSearch, EndsWhereItsShortFitsAreCancelled) {
  const GridDescriptor descriptor;
  const SparseVolume volume = test::tubeVolume();
  const ConvertOptions options = shortOptions();
  CancelToken cancel;
  cancel.cancel();
  EXPECT_THROW((void)convert::startPsnrSearch({{descriptor, volume}, options}, 28.0, cancel),
               Cancelled);
}

}  // namespace
}  // namespace esvr
