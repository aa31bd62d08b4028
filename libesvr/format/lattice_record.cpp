#include "format/lattice_record.h"

#include <cmath>

namespace esvr::format {
namespace {

constexpr int kMaxOffset = 1 << 20;  // limit on offsets of bits, for sums in 32 bits
constexpr int kMaxSlope = 1 << 12;

int getWithin(ByteReader& in, int limit, const char* what) {
  const auto n = in.get<std::int32_t>();
  if (n < -limit || n > limit) in.fail(std::string(what) + " of the lattice is out of range");
  return n;
}

double getStep(ByteReader& in, const char* what) {
  const auto step = in.get<double>();
  if (!(std::isfinite(step) && step > 0.0))
    in.fail(std::string(what) + " of the lattice is not a positive number");
  return step;
}

}  // namespace

void putLattice(ByteWriter& out, const Lattice& l) {
  out.put(l.cell);
  for (const auto low : {l.lowestCell.x, l.lowestCell.y, l.lowestCell.z}) out.put(low);
  out.put(l.scaleStep);
  out.put(l.lowestScale);
  out.put(l.intensityStep);
  for (const int n : {l.positionBase, l.positionSlope, l.scaleOffset, l.intensityBase,
                      l.intensitySlope, l.rotationOffset})
    out.put(std::int32_t(n));
  out.put(std::uint8_t(l.cellBits));
  out.put(std::uint8_t(l.signedIntensity));
  out.put(std::uint8_t(l.rotationFrom.size()));
  out.putAll(l.rotationFrom);
}

Lattice getLattice(ByteReader& in) {
  Lattice l;
  l.cell = getStep(in, "the cell");
  l.lowestCell.x = in.get<std::int32_t>();
  l.lowestCell.y = in.get<std::int32_t>();
  l.lowestCell.z = in.get<std::int32_t>();
  l.scaleStep = getStep(in, "the step of scales");
  l.lowestScale = in.get<std::int32_t>();
  l.intensityStep = getStep(in, "the step of intensities");
  l.positionBase = getWithin(in, kMaxOffset, "the base of positions");
  l.positionSlope = getWithin(in, kMaxSlope, "the slope of positions");
  l.scaleOffset = getWithin(in, kMaxOffset, "the offset of scales");
  l.intensityBase = getWithin(in, kMaxOffset, "the base of intensities");
  l.intensitySlope = getWithin(in, kMaxSlope, "the slope of intensities");
  l.rotationOffset = getWithin(in, kMaxOffset, "the offset of rotations");
  l.cellBits = in.get<std::uint8_t>();
  if (l.cellBits > Lattice::kMaxCellBits) in.fail("the lattice has too many cells");
  l.signedIntensity = in.getEnum(std::uint8_t{1}, "mark of signs") != 0;
  l.rotationFrom.resize(in.get<std::uint8_t>());
  for (auto& from : l.rotationFrom) from = in.get<std::uint8_t>();
  return l;
}

}  // namespace esvr::format
