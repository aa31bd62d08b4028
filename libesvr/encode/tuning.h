#pragma once
/// The tuned constants of the encoder, in one place. They decide how long a search takes and which
/// candidates it makes; the bytes, the PSNR and the bounds of what is stored are always measured.
/// "Lab" refers to docs/lab-notes.md.

#include <cstddef>
#include <cstdint>

namespace esvr::encode {

/// The loss by quantising, dB of PSNR over the box, at which further bytes gain as much in more ellipsoids as in
/// more bits, the one above which fewer ellipsoids are better, and the loss of quality for each dB of it.
struct Rounding {
  double usualLoss, mostLoss, factor;
};

struct Tuning {
  // ---- How ellipsoids grow with their number

  /// Active voxels per ellipsoid of the first guess for a PSNR, and at the largest number of
  /// ellipsoids that a preset may take. With more of them, voxels take fewer bytes.
  double voxelsOfFirstGuess = 35.0, leastVoxelsEach = 8.0;
  /// Bytes that an ellipsoid takes usually (by default 6.7 in smoke1 and plume_256, 8.1 in dragon) and at
  /// least, and its price in a short fit relative to that in a whole one.
  double usualBytesEach = 7.5, leastBytesEach = 4.5, shortFitPrice = 0.94;
  /// PSNR of a whole fit of 400 iterations less that of a short one of 100, dB: smoke1 and wdas have 1.3 to 1.6. Where many
  /// voxels saturate it is 5 to 6 (dragon, aneurism), since a clamped voxel has no gradient.
  double shortFitBehind = 1.6, shortFitBehindSaturated = 5.0;
  /// The same of tones (smoke1: 0.4 to 0.9, judged by what is seen).
  double tonedShortFitBehind = 0.8;
  /// Share of the active voxels with an extreme value from which on a volume saturates.
  double saturatedShare = 0.05;
  /// dB by which a whole fit may exceed its forecast (dragon, neuron_rp140212), and the steepest
  /// growth of the PSNR by twice the ellipsoids (aneurism has 6.7 dB).
  double uncertainty = 1.0, steepestDbPerDoubling = 7.0;
  /// Usual growth of what is seen of tones by twice the ellipsoids, dB: smoke1 has 2.9 to 3.4, the plume of 256 3.4,
  /// hydrogen_atom 2.3 to 4.2. Of values, and of the short fits of large volumes, it is kDbPerDoubling (plume of 640: 5.4).
  double tonedDbPerDoubling = 3.0;
  /// dB by which a fit with both signs must be better to be taken (Lab, "Signs").
  double signsGain = 0.25;

  // ---- How long fits are

  /// A short fit has a quarter of the iterations of a whole one, within these limits. At 100
  /// iterations, fit/tuning.h makes the most of them.
  std::uint32_t leastShortIterations = 50, mostShortIterations = 100;
  /// Share of a whole fit's iterations that a fit has which continues a short one, and which continues a
  /// whole one (Lab, "Continued fits").
  double continuedShare = 0.4, continuedWholeShare = 0.15;
  /// The same of a fit that continues the ellipsoids of the frame before (Lab, "Frames that continue").
  double continuedFrameShare = 0.3;
  /// The same of a fit from seeds for a size, unless many voxels saturate.
  double sizedShare = 0.6;
  /// Bricks up to which a whole fit on the CPU has all iterations of its preset; larger volumes have
  /// fewer in proportion. An iteration takes 5 to 13 us of two cores for each brick of smoke1,
  /// aneurism and neuron_m207, before the kernels of the fit took half of the time.
  double bricksOfWholeFit = 2100.0;
  /// The least share of the iterations of its preset that a whole fit has on the CPU, and the bricks up to which it has them.
  /// With 52 iterations, and 30 of short fits, the plume of 640 (40,281 bricks) became 623 KB of voxels; with 165 and 50, 20 KB.
  double leastWholeShare = 0.11, bricksInAMinute = 60'000.0;
  /// Bytes of ellipsoids from which on a whole fit has all iterations. It saves about a fifth of the
  /// bytes of a short one, which for fewer bytes is worth less time in proportion (hydrogen_atom: 560
  /// bytes in 12 CPU seconds with all iterations).
  double bytesOfWholeFit = 4096.0;

  /// Bytes that a fit on the CPU must be expected to save, compared with voxels, for each brick and iteration. These take 5 to
  /// 15 us, so that a fit saves at least some 200 bytes in each second. A fit saves 0.082 in smoke1, 0.009 in hydrogen_atom, 0.013
  /// in dragon, and 0.0008 in the shadow of gas_0006, where the fits took 30 s for 1.5 KB.
  double bytesPerWork = 0.002;

  // ---- Ellipsoids or more bits

  /// Of values (Lab, "More ellipsoids or more bits"), and of tones: smoke1 of 25 KB has 34.8 dB of what is
  /// seen with these, and 34.5 with those of values.
  Rounding rounding{0.9, 2.5, 1.0}, tonedRounding{0.5, 1.2, 1.65};

  // ---- What is seen

  /// dB by which the PSNR over the active voxels may be lower than that of the transmittance, where a tone curve
  /// is used. Cycles shows smoke1 with 34 dB over the active voxels at 41 to 43 dB (docs/convert.md).
  double picturesAboveValues = 4.0;
  /// The ninth decile of the active values relative to their median from which on a tone curve is tried, and
  /// the dB by which it must be better.
  double leastToneRange = 3.0, toneGain = 0.1;
  /// dB by which the quality that is judged must be higher where its pictures are up to this number of dB worse. Without a
  /// curve, one of 16 frames of a plume took 9.5 KB instead of 4.3, for a quality of 35.5 dB instead of 40.5 and pictures
  /// that are 0.1 dB better.
  double toneQualityGain = 2.0, mostToneLoss = 0.5;

  // ---- Voxels

  /// Price of a bit (ThriftOptions): 0.05 gives files that are up to 1 % larger at 40 to 60 dB, 0.12
  /// up to 5 % (Lab, "Voxel coding"). For voxels that are predicted from another grid or from the
  /// frame before, those whose bits are not worth their price keep to the prediction; in a frame this
  /// also means less flicker.
  double price = 0.08, predictedPrice = 0.14, framePrice = 0.2;
  /// The same of tones: 0.12 instead of 0.08 gains 0.2 dB of what is seen of smoke1 in 65 KB and 0.5 dB of the
  /// plume in 156 KB.
  double tonedPrice = 0.12;
  /// The price of the error of a brick where a volume is judged by what is seen (ThriftOptions::massPrice).
  double massPrice = 0.012;
  /// Share of the errors of the frame before that voxels keep. On a fire and a gas, 0 takes fewer
  /// bytes and flickers; a half and more takes many bytes for little less flicker.
  double errorsKept = 0.25;
  /// Share of the active voxels with one value from which on a lattice that contains it is tried.
  double plateauShare = 0.02;
  /// Bricks of the sample on which voxels of large volumes are tried, in runs of 64
  /// neighbours.
  std::size_t sampleBricks = 2048;

  // ---- Choosing

  /// Factor by which an estimate of the bytes of voxels may be wrong. Within it, voxels are coded.
  double estimateMargin = 1.2;
  /// Exact voxels are stored if they take at most this factor of the bytes of the best other grid
  /// for a PSNR, or these bytes more.
  double exactFactor = 1.03;
  std::uint64_t exactBytes = 64;
  /// Share of the bytes of voxels that ellipsoids must be expected to stay below to be fitted for a
  /// preset, and bytes of voxels below which no ellipsoids are tried: a fit takes longer than coding.
  double worthwhileShare = 0.85;
  std::uint64_t smallEnough = 1024;
};

inline constexpr Tuning kTuning{};

}  // namespace esvr::encode
