// The whole fits of a search for a size: as many ellipsoids as it allows, beside the other sections of the grid and the
// residual that corrects the signs of a narrow band.

#include <algorithm>
#include <utility>

#include "encode/ellipsoids.h"
#include "encode/signs.h"

namespace esvr::encode {

namespace {

/// Smallest growth of the bytes per ellipsoid from a fit for a size to the next, and the fits after which a size is given
/// up.
constexpr double kMoreEach = 1.25;
constexpr int kFitsUntilOneIsSmall = 5;
/// Limits for the residual of the signs of a narrow band (docs/lab-notes.md, "Signs of a size"): the largest share of a
/// size with which ellipsoids are of use, the growth for which a fit that follows one without enough room for it allows,
/// the share of a size that is used well, the loss by rounding, dB, below which a first fit was left so much room that
/// another one has more ellipsoids, and how often the bytes are divided.
constexpr double kMostOfSigns = 0.5, kMoreSigns = 0.2, kLeastShareWithSigns = 0.97,
                 kSpareLoss = 0.35;
constexpr int kMostDivisions = 3;

}  // namespace

/// A grid with the residual of its signs, if it is a narrow band of a size, where these take room that ellipsoids lack.
void EllipsoidSearch::addSigns(CompactResult& made) {
  if (!options_.fit.narrowBand || !goal_.bytes) return;
  const std::uint64_t without = bytesOfEllipsoids(made.grid);
  made.grid = completedWithSigns(std::move(made.grid), job_.input.source);
  signs_ = bytesOfEllipsoids(made.grid) - without;
}

/// False if what is beside the ellipsoids leaves them too few bytes.
bool EllipsoidSearch::hasRoom() const {
  return besides_ < *goal_.bytes && double(signs_) <= kMostOfSigns * double(*goal_.bytes);
}

/// Compacts an attempt to the bytes that the grid's other sections leave. These may be larger than those of the attempt
/// before; the bytes are then divided again.
/// \return nothing if the other sections take too many bytes
std::optional<CompactResult> EllipsoidSearch::filled(const Attempt& attempt) {
  if (signs_ > 0) return filledWithSigns(attempt);
  for (int n = 0;; ++n) {
    if (!hasRoom()) return std::nullopt;
    CompactResult now = compacted(attempt, {.bytes = *goal_.bytes - besides_});
    addSigns(now);
    needed_ = bytesOfEllipsoids(now.grid);
    const std::uint64_t besides = needed_ - now.bytes + paddingOf(now);
    if (n > 0 || besides <= besides_ + paddingOf(now)) return now;
    besides_ = besides;
  }
}

/// The same for a narrow band. The bytes of its signs differ from what they were with other steps, so that they are divided
/// again until the size is used well. A result that is too large needs another fit, since coarser steps have more wrong signs.
std::optional<CompactResult> EllipsoidSearch::filledWithSigns(const Attempt& attempt) {
  std::optional<CompactResult> best;
  const std::uint64_t size = *goal_.bytes;
  for (int n = 0; n < kMostDivisions && hasRoom(); ++n) {
    const std::uint64_t room = besides_;
    CompactResult now = compacted(attempt, {.bytes = size - room});
    addSigns(now);
    const std::uint64_t needed = bytesOfEllipsoids(now.grid);
    const bool isOver = needed > size;
    if (isOver && best) break;
    needed_ = needed;
    besides_ = needed - now.bytes + paddingOf(now);
    best = std::move(now);
    if (isOver) besides_ += std::uint64_t(kMoreSigns * double(signs_));
    if (isOver || double(needed) >= kLeastShareWithSigns * double(size)) break;
  }
  return best;
}

/// As many ellipsoids as the size allows. Where they take more bytes than expected, or would lose too
/// much by rounding, the fit is repeated with fewer.
std::optional<Conversion> EllipsoidSearch::runToSize() {
  std::optional<Conversion> best;
  double quality = 0.0, each = price_;
  const auto take = [&](Attempt attempt, CompactResult now) {
    best = conversionOf(std::move(attempt.fit), std::move(now));
  };
  for (int fits = 0; fits < (best ? plan_.wholeFits : kFitsUntilOneIsSmall); ++fits) {
    if (draft_->cancelled() || !hasRoom()) break;
    const double count = double(*goal_.bytes - besides_) / each;
    auto attempt = unlessCancelled([&]() -> std::optional<Attempt> { return wholeFit(count); });
    if (!attempt) {
      draft_->fit.end = FitEnd::kCancelled;
      break;
    }
    if (attempt->cancelled() && attempt->psnr < draft_->psnr) {  // it has just begun
      draft_->fit.end = FitEnd::kCancelled;
      break;
    }
    auto now = filled(*attempt);
    if (!now) break;
    const bool isSmall = needed_ <= *goal_.bytes, isGood = now->loss <= rounding_.mostLoss;
    // The first fit may have been left more room for its signs than it needs.
    const bool isSpare = fits == 0 && signs_ > 0 && now->loss < kSpareLoss;
    const bool isLast =
        attempt->cancelled() || (isSmall && isGood && !isSpare) || attempt->asked == 1;
    if (!isLast)
      each = std::max(
          double(compacted(*attempt, {.loss = rounding_.usualLoss, .layerErrors = false}).bytes) /
              countOf(*attempt),
          signs_ > 0 ? 0.0 : kMoreEach * each);
    attempts_.assign(1, *attempt);  // the next fit may continue it
    if (isSmall) {
      const double reached = completed(*attempt, *now);
      if (!best || reached > quality) {
        quality = reached;
        if (job_.judge) reached_ = reached;
        take(std::move(*attempt), std::move(*now));
      }
    }
    if (isLast) break;
  }
  if (best || !draft_->cancelled()) return best;
  // Nothing was found before the cancellation: the last fit is completed.
  Attempt last = std::move(attempts_.empty() ? *draft_ : attempts_.front());
  last.fit.end = FitEnd::kCancelled;
  auto now = filled(last);
  if (!now || needed_ > *goal_.bytes) throw Cancelled();
  (void)completed(last, *now);
  take(std::move(last), std::move(*now));
  return best;
}

}  // namespace esvr::encode
