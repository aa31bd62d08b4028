#pragma once
/// What a conversion is judged by, and the tone curve that it codes values with.

#include <optional>
#include <span>

#include "encode/ellipsoids.h"
#include "esvr/tone.h"
#include "metrics/transmittance.h"

namespace esvr::encode {

/// Measures how good a volume is, in dB. A volume that is looked through is judged by the transmittance
/// of its median column of 0.5 (esvr/metrics.h), and every other one by the PSNR over the box.
class Judge {
 public:
  /// \param input  the values; they and ConvertOptions::filled must outlive the object
  /// \param tone   the volumes that are judged have tones
  Judge(const ConvertInput& input, const ConvertOptions& options, ToneCurve tone);

  /// True if the goal of the options is one of pictures, and the volume is looked through.
  [[nodiscard]] static bool seesPictures(const ConvertInput& input, const ConvertOptions& options);

  [[nodiscard]] bool seesPictures() const { return pictures_.has_value(); }

  /// What a judge says of decoded tones, dB.
  struct Judgement {
    double quality = 0.0;
    /// The mean of the transmittance's PSNR for T = 0.5 and 0.1; 0 unless pictures are seen. Of two tone curves, the one
    /// for which it is larger is better for thin and for dense smoke.
    double forTones = 0.0;
  };
  [[nodiscard]] Judgement operator()(SparseVolume volume) const;

  /// The total mass of the source; 0 unless pictures are seen.
  [[nodiscard]] double mass() const { return mass_; }
  /// The total mass of the values of tones.
  [[nodiscard]] double massOf(const SparseVolume& tones) const {
    return growingMass(tones, 1.0).total;
  }

  /// The factor of decoded tones with which their mass is the wanted one: that of the source, or of a sample of it.
  [[nodiscard]] double massFactor(double wanted, const SparseVolume& decoded) const;

  [[nodiscard]] const SparseVolume& values() const { return values_; }
  [[nodiscard]] ToneCurve tone() const { return tone_; }
  /// The box and the peak of the PSNR over values.
  [[nodiscard]] const CompareOptions& comparison() const { return box_; }

 private:
  void toValues(SparseVolume& volume) const;
  void toValues(std::span<const float> tones, float factor, std::span<float> values) const;

  /// The total mass of the values of tones that are multiplied by a factor, and its growth with the factor.
  struct Mass {
    double total = 0.0, growth = 0.0;
  };
  [[nodiscard]] Mass growingMass(const SparseVolume& tones, double factor) const;

  const SparseVolume& values_;
  const VoxelLayer* filled_;  ///< ConvertOptions::filled
  ToneCurve tone_;
  ValueRange range_;
  bool halfs_;
  CompareOptions box_;
  double mass_ = 0.0;
  /// dB that are added to the PSNR over the box, which then is a second limit of the quality; nothing: it is
  /// none.
  std::optional<double> valueGain_;
  std::optional<metrics::TransmittanceReference> pictures_;
};

/// A tone curve, and what the fit showed with which it was found to be better than another one, if there was one.
struct ToneChoice {
  ToneCurve tone;
  std::optional<FitPoint> scout{};
};

/// The tone curve of a conversion: that of the options, that of the previous frame, or the one with which
/// a short fit is better than without, where the values call for one.
[[nodiscard]] ToneChoice chooseTone(const ConvertInput& input, const ConvertOptions& options);

/// Voxels within a bound relative to each value, and the curve whose tones they hold.
struct RelativeLayer {
  VoxelLayer layer;
  ToneCurve tone;  ///< off: they hold values
};
[[nodiscard]] RelativeLayer relativeLayer(const Job& job, const RelativeBoundGoal& goal);

/// Checks that a decoded grid is within a bound relative to each value.
/// \throws RuntimeFailure  a voxel is not; the text names the grid and the voxel
void requireRelativeBound(const ConvertInput& input, const SparseVolume& decoded,
                          const RelativeBoundGoal& goal);

/// Scales the sum of a quantised grid that is judged by what is seen, so that its total mass is the source's. Errors of
/// tones have a mean of about 0, and those of the values that they stand for do not. The bytes stay as they are.
/// \param grid  holds tones like values, before setTone()
/// \return the quality of the grid then, dB; clamps of the few values that reach the end of the range are not counted
[[nodiscard]] double keepMass(const Job& job, StoredGrid& grid);

/// The tones of a volume.
[[nodiscard]] SparseVolume tonesOf(const SparseVolume& volume, ToneCurve tone);

/// Makes a grid of tones, which was converted like one of values, a grid of values.
void setTone(const ConvertInput& input, ToneCurve tone, StoredGrid& grid);

}  // namespace esvr::encode
