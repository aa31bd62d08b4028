#pragma once
/// Tables of a transfer function, with opacities that are corrected for the distance between
/// samples. A renderer looks up every sample, or every segment between two samples, in them.
/// Look-ups are compiled for host and device.

#include <cmath>
#include <cstdint>
#include <vector>

#include "esvr/ellipsoids.h"
#include "esvr/transfer_function.h"

namespace esvr {

/// The values between the first and the last point of a transfer function, which its tables cover.
struct ValueExtent {
  double low, high;

  /// True if the extent is 0, or so small that float32 cannot divide a table's length by it.
  [[nodiscard]] bool flat() const;
  /// \param share  0 for the lowest value, 1 for the highest
  [[nodiscard]] double at(double share) const { return low + (high - low) * share; }
  /// A value that no point reaches. Several points may have the same x: below it, the first of them
  /// counts, and above it the last.
  [[nodiscard]] double below() const;
};
[[nodiscard]] ValueExtent extentOf(const TransferFunction& function);

// Samples.

/// A color and opacity, not premultiplied.
struct alignas(16) Classified {
  float r, g, b, alpha;
};

// Segments. In pre-integrated classification, the value is taken to change linearly between two
// consecutive samples of a ray, so that the light of the segment between them follows from
// integrals of the transfer function over the value (docs/math.md). A table holds these integrals.

/// A color that is premultiplied by its opacity.
struct alignas(16) PixelColor {
  float r, g, b, alpha;
};

/// One interval of values. The channels are red, green and blue, each times the extinction, and the
/// extinction itself, for the length of a step.
///
/// The integrals are integers because the light of a segment is the difference of two of them. With
/// 32 bits, the difference is exact to 2^-32 of the largest integral, which is 4096 intervals times
/// SegmentTableView::kMaxExtinction. An opacity therefore errs by less than 1e-4, however much
/// larger the extinction of other values is. Floats of the same size would err by 256 times as
/// much, and float64 is slow on many GPUs.
struct SegmentEntry {
  static constexpr int kChannels = 4, kExtinction = 3;

  /// The channels of an entry, which a device reads at once.
  template <class T>
  struct alignas(16) Channels {
    T c[kChannels];
  };

  Channels<std::uint32_t> before;  ///< integrals from the table's lowest value to the interval
  Channels<float> mean;            ///< mean over the interval
};

/// The values between two places of a table. Places count intervals from the table's lowest value.
/// Interval n ends at place n; the first and the last have no other end, because the transfer
/// function is constant there.
///
/// The parts in the first and in the last interval are summed by themselves, so that integrals are
/// subtracted only where at least one whole interval lies between them.
struct SegmentSpan {
  static constexpr int kIntervals = 4096;

  const SegmentEntry *first, *next, *last;  ///< next: the end of the first, or the same as the last
  float inFirst, inLast;                    ///< shares of the span
  float ofWhole;                            ///< share of a whole interval

  ESVR_HD SegmentSpan(const SegmentEntry* entries, float a, float b) {
    constexpr float kSame = 1e-6f;  // closer places have no values between them
    const float from = a < b ? a : b, to = a < b ? b : a;
    const int i = intervalAt(from), j = intervalAt(to);
    const bool same = i == j || to - from < kSame;
    first = entries + i, last = entries + j, next = same ? last : first + 1;
    ofWhole = same ? 1.0f : 1.0f / (to - from);
    inFirst = same ? 0.0f : (float(i) - from) * ofWhole;
    inLast = same ? 1.0f : (to - float(j - 1)) * ofWhole;
  }
  /// The means of the channels; alpha is the extinction.
  /// \param unit  what one unit of the integrals stands for
  [[nodiscard]] ESVR_HD PixelColor means(float unit) const {
    const SegmentEntry::Channels<float> a = first->mean, b = last->mean;
    const SegmentEntry::Channels<std::uint32_t> begin = next->before, end = last->before;
    const float ofUnit = unit * ofWhole;
    const auto mean = [&](int c) {
      return inFirst * a.c[c] + inLast * b.c[c] + float(end.c[c] - begin.c[c]) * ofUnit;
    };
    return {mean(0), mean(1), mean(2), mean(SegmentEntry::kExtinction)};
  }

 private:
  /// Interval 0 lies below the table, and kIntervals + 1 above it.
  ESVR_HD static int intervalAt(float place) {
    const float above = place > -1.0f ? place : -1.0f;
    return above < 0.0f ? 0 : int(above < float(kIntervals) ? above : float(kIntervals)) + 1;
  }
};

/// Pointers to a table in host or device memory.
struct SegmentTableView {
  /// Stands for the infinite extinction of an opacity of 1. A segment is opaque to within rounding
  /// if a quarter of it has this extinction.
  static constexpr float kMaxExtinction = 64.0f;

  const SegmentEntry* entries;
  float low, scale;  ///< lowest value, and intervals per unit of value
  float unit;        ///< what one unit of the integrals stands for
  float leastBend;   ///< intervals, infinite for a transparent table; see bends()
  PixelColor nan;

  /// The light of the segment from a sample to the next, whose values are a and b. The color of a
  /// segment is the mean of its colors, weighted by their extinction, as if none of its light were
  /// absorbed within it. A segment of high extinction is therefore divided into pieces.
  /// \param length  of the segment in steps
  [[nodiscard]] ESVR_HD PixelColor operator()(float a, float b, float length = 1.0f) const {
    if (!(a == a) || !(b == b)) return nan;
    const float from = placeOf(a), to = placeOf(b);
    const PixelColor whole = SegmentSpan(entries, from, to).means(unit);
    const float pieces = piecesOf(whole.alpha * length);
    PixelColor all{0.0f, 0.0f, 0.0f, 0.0f};
    if (pieces <= 1.0f) {
      addBehind(all, whole, length);
      return all;
    }
    const float share = 1.0f / pieces, apart = (to - from) * share;
    for (float p = 0.0f; p < pieces; ++p)
      addBehind(all, SegmentSpan(entries, from + p * apart, from + (p + 1.0f) * apart).means(unit),
                length * share);
    return all;
  }

  /// Whether the values of a segment are so far from a straight line that its light may be wrong.
  /// If the values before the segment are linear and have one bend within it, they differ from the
  /// line between its ends by less than the change along it differs from the change before.
  /// Values beyond the table look alike, so that bends among them do not matter.
  /// \param a, b          values of the samples at its ends
  /// \param changeBefore  of the value over a step before the segment
  /// \param weight        transmittance in front of the segment
  [[nodiscard]] ESVR_HD bool bends(float a, float b, float changeBefore, float weight) const {
    const float bend = std::fabs(b - a - changeBefore) * scale;
    if (!(bend * weight > leastBend)) return false;
    const float from = placeOf(a), to = placeOf(b);
    return (from < to ? from : to) - bend < float(SegmentSpan::kIntervals) &&
           (from < to ? to : from) + bend > 0.0f;
  }

 private:
  /// Values far beyond the table are as good as values a little beyond it, but are finite.
  [[nodiscard]] ESVR_HD float placeOf(float value) const {
    constexpr float kFar = 1e9f;
    const float place = (value - low) * scale;
    return place < -kFar ? -kFar : (place > kFar ? kFar : place);
  }
  /// Pieces are so thin that one more or less, by rounding, changes a channel by less than 1/255.
  ESVR_HD static float piecesOf(float extinction) {
    constexpr float kThin = 0.25f, kMost = 16.0f;
    if (!(extinction > 0.0f)) return 0.0f;
    return extinction < kThin * kMost ? std::ceil(extinction / kThin) : kMost;
  }
  /// 1 - exp(-t). A series replaces the difference where it cancels.
  ESVR_HD static float absorbed(float t) {
    constexpr float kSmall = 1.0f / 64.0f;  // the next term of the series is below 3e-9
    return t < kSmall ? t * (1.0f - t * (0.5f - t * (1.0f / 6.0f))) : 1.0f - std::exp(-t);
  }
  /// \param means   means over a piece
  /// \param length  length of the piece in steps
  ESVR_HD static void addBehind(PixelColor& all, const PixelColor& means, float length) {
    if (!(means.alpha > 0.0f)) return;
    const float alpha = (1.0f - all.alpha) * absorbed(means.alpha * length);
    const float share = alpha / means.alpha;
    all.r += share * means.r;
    all.g += share * means.g;
    all.b += share * means.b;
    all.alpha += alpha;
  }
};

// The tables.

/// Pointers to both tables in host or device memory.
struct TransferTableView {
  static constexpr int kIntervals = SegmentSpan::kIntervals;
  static constexpr float kNoExtent = 0.0f;

  const Classified* entries;  ///< kIntervals + 1 entries
  float low, scale;           ///< lowest value, and intervals per unit of value
  Classified nan;
  SegmentTableView segments;  ///< empty unless Sampling::segments asked for it

  /// The color and opacity of a value.
  [[nodiscard]] ESVR_HD Classified operator()(float value) const {
    if (!(value == value)) return nan;
    const float place =
        scale == kNoExtent ? (value < low ? 0.0f : float(kIntervals)) : (value - low) * scale;
    if (!(place > 0.0f)) return entries[0];
    if (place >= float(kIntervals)) return entries[kIntervals];
    const int i = int(place);
    return between(entries[i], entries[i + 1], place - float(i));
  }

 private:
  ESVR_HD static Classified between(const Classified& a, const Classified& b, float s) {
    return {a.r + s * (b.r - a.r), a.g + s * (b.g - a.g), a.b + s * (b.b - a.b),
            a.alpha + s * (b.alpha - a.alpha)};
  }
};

/// What the tables are made for.
struct Sampling {
  double length;  ///< length of a step, in units of the length that opacities are given for
  bool segments;  ///< true if segments between samples are looked up
  friend bool operator==(const Sampling&, const Sampling&) = default;
};
class TransferTable {
 public:
  TransferTable(const TransferFunction& function, const Sampling& sampling);

  [[nodiscard]] TransferTableView view() const { return on(values_.data(), segments_.data()); }
  /// A view of copies of both tables' entries, for example on a device.
  [[nodiscard]] TransferTableView on(const Classified* values, const SegmentEntry* segments) const;

  [[nodiscard]] const std::vector<Classified>& values() const { return values_; }
  /// Empty unless Sampling::segments asked for them.
  [[nodiscard]] const std::vector<SegmentEntry>& segments() const { return segments_; }

 private:
  void integrate(const TransferFunction& function, double length);

  float low_, scale_;
  std::vector<Classified> values_;
  Classified nan_;
  std::vector<SegmentEntry> segments_;
  float segmentScale_ = 1.0f, unit_ = 0.0f, leastBend_ = 0.0f;  ///< see SegmentTableView
  PixelColor nanSegment_{};
};

}  // namespace esvr
