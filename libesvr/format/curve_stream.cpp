#include "format/curve_stream.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "esvr/error.h"
#include "format/byte_reader.h"
#include "format/byte_writer.h"

namespace esvr::format {
namespace {

constexpr std::size_t kPointBytes = 4 * sizeof(std::uint64_t) + sizeof(std::uint32_t);

/// A PSNR is infinite where the error is zero.
bool valid(const CurvePoint& p) {
  return std::isfinite(p.maxError) && !std::isnan(p.psnrBox) && !std::isnan(p.psnrActive);
}
constexpr const char* kInvalid = "a point of the curve is not a number";

/// Calls `visit` with each member of a point, in the order of the file.
template <class Visit>
void forEachMember(Visit visit) {
  visit(&CurvePoint::ellipsoids);
  visit(&CurvePoint::psnrBox);
  visit(&CurvePoint::psnrActive);
  visit(&CurvePoint::maxError);
  visit(&CurvePoint::iteration);
}

template <class T>
T readAs(ByteReader& in, const T&) {
  return in.get<T>();
}

}  // namespace

std::vector<std::byte> putCurve(std::span<const CurvePoint> curve) {
  if (!std::all_of(curve.begin(), curve.end(), valid)) throw RuntimeFailure(kInvalid);
  ByteWriter out;
  forEachMember([&](auto member) {
    for (const auto& point : curve) out.put(point.*member);
  });
  return out.take();
}

std::vector<CurvePoint> getCurve(std::span<const std::byte> content, const std::string& where) {
  ByteReader in(content, where);
  if (content.size() % kPointBytes != 0) in.fail("not a whole number of points");
  std::vector<CurvePoint> curve(content.size() / kPointBytes);
  forEachMember([&](auto member) {
    for (auto& point : curve) point.*member = readAs(in, point.*member);
  });
  if (!std::all_of(curve.begin(), curve.end(), valid)) in.fail(kInvalid);
  return curve;
}

}  // namespace esvr::format
