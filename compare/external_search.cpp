#include "compare/external_search.h"

#include <cmath>
#include <functional>
#include <limits>

#include "esvr/metrics.h"

namespace esvr::compare {
namespace {

constexpr double kDecade = 10.0;
constexpr int kDecades = 9;         // bounds from the peak to its 1e-9
constexpr int kMaxBisections = 10;  // a step of 10 is then divided into parts of 0.2 %
constexpr double kSufficientFill = 0.98;
constexpr double kSufficientExcess = 0.05;  // dB

/// What a search wants of its trials.
struct Aim {
  std::function<bool(const ExternalStep&)> allowed;     ///< may this trial be the result?
  std::function<bool(const ExternalStep&)> tooFine;     ///< should the next bound be larger?
  std::function<bool(const ExternalStep&)> sufficient;  ///< may the search end with this trial?
  std::function<bool(const ExternalStep&, const ExternalStep&)> better;
  bool measuresAll = false;  ///< whether the PSNR of trials that are not allowed matters
  bool active = false;       ///< whether the PSNR is that over the active voxels
};

class Search {
 public:
  Search(ExternalCodec& codec, const Aim& aim) : codec_(codec), aim_(aim) {}

  ExternalMatch run() {
    double coarse = codec_.source().peak;
    bool passed = tooFine(coarse);
    for (int i = 0; i < kDecades && !passed && !ended_; ++i) {
      passed = tooFine(coarse / kDecade);
      if (passed && !ended_)
        bisect(coarse, coarse / kDecade);
      else
        coarse /= kDecade;
    }
    return std::move(match_);
  }

 private:
  void bisect(double coarse, double fine) {
    for (int i = 0; i < kMaxBisections && !ended_; ++i) {
      const double middle = std::sqrt(coarse * fine);
      (tooFine(middle) ? fine : coarse) = middle;
    }
  }

  /// Tries a bound and keeps the trial if it is the best so far.
  bool tooFine(double bound) {
    ExternalStep step{bound, codec_.encode(bound).bytes, std::numeric_limits<double>::quiet_NaN()};
    if (aim_.measuresAll || aim_.allowed(step)) step.psnr = psnr();
    match_.steps.push_back(step);
    if (aim_.allowed(step) && (!match_.found || aim_.better(step, match_.best))) {
      match_.best = step;
      match_.found = true;
    }
    ended_ = aim_.allowed(step) && aim_.sufficient(step);
    return aim_.tooFine(step);
  }

  double psnr() {
    const ExternalSource& source = codec_.source();
    const CompareOptions options{.box = source.box, .peak = source.peak};
    const SparseVolume decoded = codec_.decode();
    return aim_.active ? compareVolumes(source.volume, decoded, options).psnrActive
                       : psnrOverBox(source.volume, decoded, options);
  }

  ExternalCodec& codec_;
  const Aim& aim_;
  ExternalMatch match_;
  bool ended_ = false;
};

}  // namespace

ExternalMatch matchSize(ExternalCodec& codec, std::uint64_t bytes) {
  using Step = ExternalStep;
  const Aim aim{
      .allowed = [=](const Step& s) { return s.bytes <= bytes; },
      .tooFine = [=](const Step& s) { return s.bytes > bytes; },
      .sufficient =
          [=](const Step& s) { return double(s.bytes) >= kSufficientFill * double(bytes); },
      .better = [](const Step& a, const Step& b) { return a.psnr > b.psnr; }};
  return Search(codec, aim).run();
}

ExternalMatch matchPsnr(ExternalCodec& codec, const MatchGoal& goal) {
  using Step = ExternalStep;
  const double psnr = goal.psnr;
  const Aim aim{.allowed = [=](const Step& s) { return s.psnr >= psnr; },
                .tooFine = [=](const Step& s) { return s.psnr >= psnr; },
                .sufficient = [=](const Step& s) { return s.psnr <= psnr + kSufficientExcess; },
                .better = [](const Step& a, const Step& b) { return a.bytes < b.bytes; },
                .measuresAll = true,
                .active = goal.active};
  return Search(codec, aim).run();
}

}  // namespace esvr::compare
