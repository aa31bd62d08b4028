#pragma once
/// Pre-integrated classification. Between two consecutive samples of a ray, the value is taken to
/// change linearly, so that the light of the segment between them follows from integrals of the
/// transfer function over the value (docs/math.md). A table holds these integrals. The look-up is
/// compiled for host and device.

#include <cmath>
#include <cstdint>
#include <vector>

#include "esvr/kernel.h"
#include "esvr/transfer_function.h"

namespace esvr {

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
struct alignas(16) SegmentEntry {
  static constexpr int kChannels = 4, kExtinction = 3;

  std::uint32_t before[kChannels];  ///< integrals from the table's lowest value to the interval
  float mean[kChannels];            ///< mean over the interval
};

/// Pointers to a table in host or device memory. Places count intervals from the table's lowest
/// value. Interval n ends at place n; the first and the last have no other end, because the
/// transfer function is constant there.
struct SegmentTableView {
  static constexpr int kIntervals = 4096;
  static constexpr int kEntries = kIntervals + 2;
  /// Stands for the infinite extinction of an opacity of 1. A segment is opaque to within rounding
  /// if a quarter of it has this extinction.
  static constexpr float kMaxExtinction = 64.0f;

  const SegmentEntry* entries;
  float low, scale;  ///< lowest value, and intervals per unit of value
  float unit;        ///< what one unit of the integrals stands for
  PixelColor nan;

  /// The light of the segment from a sample to the next, whose values are a and b. The color of a
  /// segment is the mean of its colors, weighted by their extinction, as if none of its light were
  /// absorbed within it. A segment of high extinction is therefore divided into pieces.
  [[nodiscard]] ESVR_HD PixelColor operator()(float a, float b) const {
    if (!(a == a) || !(b == b)) return nan;
    const float from = placeOf(a), to = placeOf(b);
    const Means whole = meansOver(from, to);
    const float extinction = whole.of[SegmentEntry::kExtinction];
    if (extinction <= kThin || from == to) return lightOf(whole, 1.0f);
    const float pieces =
        std::ceil(extinction < kThin * kMaxPieces ? extinction / kThin : kMaxPieces);
    return composited(from, (to - from) / pieces, int(pieces));
  }

 private:
  struct Means {
    float of[SegmentEntry::kChannels];
  };
  /// Places closer to each other than this have no segment between them, only a value.
  static constexpr float kSame = 1e-6f;
  /// Extinction of a piece, and largest number of pieces of a segment.
  static constexpr float kThin = 0.5f, kMaxPieces = 16.0f;

  /// Values far beyond the table are as good as values a little beyond it, but are finite.
  [[nodiscard]] ESVR_HD float placeOf(float value) const {
    constexpr float kFar = 1e9f;
    const float place = (value - low) * scale;
    return place < -kFar ? -kFar : (place > kFar ? kFar : place);
  }
  ESVR_HD static int intervalAt(float place) {
    if (place < 0.0f) return 0;
    return place < float(kIntervals) ? int(place) + 1 : kIntervals + 1;
  }
  [[nodiscard]] ESVR_HD Means meansOver(float a, float b) const {
    return a < b ? meansUpwards(a, b) : meansUpwards(b, a);
  }
  /// The parts of the segment in its first and in its last interval are summed by themselves, so
  /// that integrals are subtracted only where at least one whole interval lies between them.
  [[nodiscard]] ESVR_HD Means meansUpwards(float from, float to) const {
    const int i = intervalAt(from), j = intervalAt(to);
    const bool same = i == j || to - from < kSame;
    const SegmentEntry &first = entries[i], &last = entries[j], &next = entries[same ? j : i + 1];
    const float inverse = same ? 1.0f : 1.0f / (to - from);
    const float inFirst = same ? 0.0f : (float(i) - from) * inverse;
    const float inLast = same ? 1.0f : (to - float(j - 1)) * inverse;
    Means means;
    for (int c = 0; c < SegmentEntry::kChannels; ++c)
      means.of[c] = inFirst * first.mean[c] + inLast * last.mean[c] +
                    float(last.before[c] - next.before[c]) * (unit * inverse);
    return means;
  }
  /// \param length  length of the segment in steps
  ESVR_HD static PixelColor lightOf(const Means& means, float length) {
    const float extinction = means.of[SegmentEntry::kExtinction];
    if (!(extinction > 0.0f)) return {0.0f, 0.0f, 0.0f, 0.0f};
    const float alpha = -std::expm1(-extinction * length), share = alpha / extinction;
    return {means.of[0] * share, means.of[1] * share, means.of[2] * share, alpha};
  }
  [[nodiscard]] ESVR_HD PixelColor composited(float from, float apart, int pieces) const {
    const float length = 1.0f / float(pieces);
    PixelColor all{0.0f, 0.0f, 0.0f, 0.0f};
    for (int p = 0; p < pieces; ++p) {
      const float begin = from + float(p) * apart;
      const PixelColor piece = lightOf(meansOver(begin, begin + apart), length);
      const float left = 1.0f - all.alpha;
      all.r += left * piece.r, all.g += left * piece.g, all.b += left * piece.b;
      all.alpha += left * piece.alpha;
    }
    return all;
  }
};

class SegmentTable {
 public:
  /// An empty table, which must not be read.
  SegmentTable() = default;
  /// \param length  length of a step, in units of the length that opacities are given for
  SegmentTable(const TransferFunction& function, double length);

  [[nodiscard]] SegmentTableView view() const { return on(entries_.data()); }
  [[nodiscard]] const std::vector<SegmentEntry>& entries() const { return entries_; }
  /// A view of a copy of the entries, for example on a device.
  [[nodiscard]] SegmentTableView on(const SegmentEntry* entries) const {
    return {entries, low_, scale_, unit_, nan_};
  }

 private:
  std::vector<SegmentEntry> entries_;
  float low_ = 0.0f, scale_ = 1.0f, unit_ = 0.0f;
  PixelColor nan_{};
};

}  // namespace esvr
