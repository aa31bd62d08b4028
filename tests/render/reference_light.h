#pragma once
/// The light of a ray in float64, by the definition in docs/math.md.

#include <array>
#include <vector>

#include "esvr/render.h"

namespace esvr::test {

/// Red, green and blue, each times the extinction, and the extinction.
using Channels = std::array<double, 4>;

[[nodiscard]] Channels channelsAt(const TransferFunction& function, double value, double length);

/// The integrals of a transfer function over the value, at 16 times the places of the library.
class Integrals {
 public:
  /// \param length  length of a step, in units of the length that opacities are given for
  Integrals(const TransferFunction& function, double length);

  [[nodiscard]] Channels meanBetween(double a, double b) const;
  [[nodiscard]] Channels at(double value) const { return channelsAt(function_, value, length_); }

 private:
  [[nodiscard]] double placeOf(double value) const;
  [[nodiscard]] double upTo(double place, std::size_t channel) const;

  TransferFunction function_;
  double length_, low_, scale_;
  std::vector<Channels> means_;   ///< of the values below, of each interval, and of those above
  std::vector<Channels> before_;  ///< integrals up to each interval
};

/// Premultiplied color, and what is left of the light behind.
struct Light {
  double r = 0.0, g = 0.0, b = 0.0, transmittance = 1.0;
};

class LightOnRay {
 public:
  LightOnRay(const Integrals& integrals, double background, Classification classification)
      : integrals_(integrals),
        background_(background),
        last_(background),
        classification_(classification) {}

  /// Adds the next sample. Values that are exactly the background are empty space.
  void add(double value);
  [[nodiscard]] const Light& light() const { return light_; }

 private:
  void addSegment(double a, double b);
  void absorb(const Channels& mean, double length);

  const Integrals& integrals_;
  double background_, last_;
  Classification classification_;
  Light light_;
};

}  // namespace esvr::test
