#pragma once
/// The search for ellipsoids that have a PSNR or a size: a short fit, which forecasts the number and
/// the bytes of the ellipsoids, and then one or two whole fits.

#include <cstdint>
#include <optional>
#include <vector>

#include "encode/attempt.h"

namespace esvr::encode {

/// Bytes that an ellipsoid takes usually (by default 6.7 in smoke1 and plume_256, 8.1 in dragon) and at least.
inline constexpr double kUsualBytesEach = 7.5, kLeastBytesEach = 4.5;
/// dB by which a whole fit may exceed its forecast (dragon, neuron_rp140212).
inline constexpr double kUncertainty = 1.0;

/// The loss by quantising, dB of PSNR over the box, at which further bytes gain as much in more ellipsoids as in
/// more bits, the one above which fewer ellipsoids are better, and the loss of quality for each dB of it.
struct Rounding {
  double usualLoss, mostLoss, factor;
};

/// The number of ellipsoids of a short fit that shows what suits a job, before anything is known.
[[nodiscard]] double scoutCount(const Job& job);

/// dB by which the float32 grid should exceed a PSNR: the best value, and the limits within which the size
/// hardly differs.
struct Margin {
  double aim, min, max;
};

/// Searches the smallest grid of ellipsoids with a PSNR, or the best one with a size. At most
/// Plan::wholeFits whole fits are made (up to four if few ellipsoids suffice, or while each is far above the PSNR; for a
/// size up to five, if the ellipsoids of none before keep to it), and at most six short ones: four to find the number of
/// ellipsoids, one to decide about their signs, and one that shows that averages do not suffice. For Preset::kHigh, one of
/// them is continued (probe()). A frame of a sequence continues the ellipsoids of the frame before instead of making short
/// fits.
class EllipsoidSearch {
 public:
  /// \param before  the ellipsoids to continue, with a PSNR; null: there are none
  EllipsoidSearch(const Job& job, const Aim& goal, const StoredGrid* before = nullptr);
  EllipsoidSearch(const EllipsoidSearch&) = delete;
  EllipsoidSearch& operator=(const EllipsoidSearch&) = delete;

  /// Sets the bytes that a grid with a PSNR must stay below to be of use, before the short fits or after them. Fits end
  /// early where it would not.
  void stayBelow(std::uint64_t bytes);

  /// Makes the short fits. \param cancel  cancels them alone; null: the job's token does
  /// \throws Cancelled  they were cancelled before they had a result
  void draft(const CancelToken* cancel = nullptr);

  /// The PSNR (for a size) or the bytes (for a PSNR) to expect of the whole fits.
  [[nodiscard]] double expectedPsnr() const;
  [[nodiscard]] std::uint64_t expectedBytes() const { return expectedBytes_; }
  /// For a PSNR: the iterations of the first whole fit times the bricks that it passes over, after the short fits.
  [[nodiscard]] double expectedWork() const;
  /// About the bytes for a PSNR by what Job::scout shows, before the short fits; nothing if there is no scout.
  [[nodiscard]] std::optional<double> scoutedBytes() const;

  /// False if the drafts show that the grid cannot stay below a number of bytes, or, for a size, that
  /// it cannot have a PSNR, even if it is better than expected by kUncertainty.
  [[nodiscard]] bool mayStayBelow(std::uint64_t bytes) const;
  [[nodiscard]] bool mayReach(double psnr) const;

  /// Makes the whole fits. For a PSNR that is missed, the best of them is marked kPsnrMissed.
  /// \return nothing if the grid does not fit into the size; needed() says what it takes then
  [[nodiscard]] std::optional<Conversion> run();
  /// The judged quality of the result, dB, if it was measured.
  [[nodiscard]] const std::optional<double>& reached() const { return reached_; }

  [[nodiscard]] std::uint64_t needed() const { return needed_; }
  /// True if there is a short fit, and if it was not cancelled.
  [[nodiscard]] bool hasDraft() const { return draft_.has_value(); }
  [[nodiscard]] bool drafted() const { return draft_ && !draft_->cancelled(); }

 private:
  [[nodiscard]] Attempt shortFit(double count) const;
  [[nodiscard]] double firstCountForPsnr() const;
  [[nodiscard]] Attempt wholeFit(double count) const;
  [[nodiscard]] std::uint32_t shareOfWhole(double share) const;
  [[nodiscard]] Attempt continued(const StoredGrid& from, double count, double share) const;
  [[nodiscard]] const Attempt* startFor(double count) const;
  [[nodiscard]] CompactResult compacted(const Attempt& attempt, CompactOptions target) const;
  [[nodiscard]] std::optional<QuantiserSteps> stepsOfFrameBefore(double loss) const;
  [[nodiscard]] Conversion storedForPsnr(Attempt attempt);
  [[nodiscard]] double completed(const Attempt& attempt, CompactResult& rounded) const;
  void learnFrom(const Attempt& other);
  void draftNearPsnr();
  void draftFirst();
  [[nodiscard]] bool mayFitAverages(double count) const;
  [[nodiscard]] bool averagesSuffice() const;
  void fitAverages();
  void fitVoxels();
  [[nodiscard]] double countOfFrame(const StoredGrid& before) const;
  void continueFrame();
  void decideSigns();
  [[nodiscard]] bool mayProbe() const;
  void probe();
  void forecast();

  [[nodiscard]] double behind() const;
  [[nodiscard]] double aim() const;
  [[nodiscard]] double leastAfterMisses() const;
  [[nodiscard]] double capped(double count) const;
  [[nodiscard]] double nextCount() const;
  [[nodiscard]] bool isEnough() const;
  [[nodiscard]] int mostWholeFits() const;
  [[nodiscard]] std::optional<Conversion> runToPsnr();
  [[nodiscard]] std::optional<Conversion> runToSize();
  void addSigns(CompactResult& made);
  [[nodiscard]] bool hasRoom() const;
  [[nodiscard]] std::optional<CompactResult> filled(const Attempt& attempt);
  [[nodiscard]] std::optional<CompactResult> filledWithSigns(const Attempt& attempt);
  [[nodiscard]] Conversion smallestOrBest();

  ConvertOptions options_;
  SparseVolume averages_;
  Job job_;
  Aim goal_;
  const StoredGrid* before_;
  std::optional<std::uint64_t> below_;  ///< stayBelow()
  Plan plan_;
  bool compact_, saturates_;
  Rounding rounding_;
  Margin margin_;
  double slope_;               ///< growth of the quality by twice the ellipsoids, dB
  bool slopeIsKnown_ = false;  ///< from two short fits
  bool isProbed_ = false;      ///< the last short fit was continued by probe()
  bool isTooLarge_ = false;    ///< the short fits showed that the grid cannot stay below `below_`
  std::uint64_t maxCount_;
  std::optional<Attempt> draft_;    ///< the last short fit
  std::vector<FitPoint> drafted_;   ///< all of them that are like it
  double price_ = kUsualBytesEach;  ///< expected bytes of an ellipsoid
  std::uint64_t besides_ = 0;       ///< bytes of the grid's other sections
  std::uint64_t signs_ = 0;         ///< those of the residual of signs among them
  std::uint64_t expectedBytes_ = 0, needed_ = 0;
  std::vector<Attempt> attempts_;
  std::optional<double>
      reached_;  ///< the judged quality, dB, of the conversion that was made last or kept
};

}  // namespace esvr::encode
