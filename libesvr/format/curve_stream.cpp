#include "format/curve_stream.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "esvr/error.h"
#include "format/byte_reader.h"
#include "format/byte_writer.h"

namespace esvr::format {
namespace {

constexpr std::size_t kPointBytes = 28;

/// A PSNR is infinite where the error is zero.
bool valid(const CurvePoint& p) {
  return std::isfinite(p.maxError) && !std::isnan(p.psnrBox) && !std::isnan(p.psnrActive);
}
constexpr const char* kInvalid = "a point of the curve is not a number";

/// Calls `visit` with each member of a point and a number of its type in the file, in the order of the file.
template <class Visit>
void forEachMember(Visit visit) {
  visit(&CurvePoint::ellipsoids, std::uint64_t{});
  visit(&CurvePoint::psnrBox, float{});
  visit(&CurvePoint::psnrActive, float{});
  visit(&CurvePoint::maxError, double{});
  visit(&CurvePoint::iteration, std::uint32_t{});
}

}  // namespace

std::vector<std::byte> putCurve(std::span<const CurvePoint> curve) {
  if (!std::all_of(curve.begin(), curve.end(), valid)) throw RuntimeFailure(kInvalid);
  ByteWriter out;
  forEachMember([&](auto member, auto stored) {
    for (const auto& point : curve) out.put(decltype(stored)(point.*member));
  });
  return out.take();
}

std::vector<CurvePoint> getCurve(std::span<const std::byte> content, const std::string& where) {
  ByteReader in(content, where);
  if (content.size() % kPointBytes != 0) in.fail("not a whole number of points");
  std::vector<CurvePoint> curve(content.size() / kPointBytes);
  forEachMember([&](auto member, auto stored) {
    for (auto& point : curve) point.*member = in.get<decltype(stored)>();
  });
  if (!std::all_of(curve.begin(), curve.end(), valid)) in.fail(kInvalid);
  return curve;
}

}  // namespace esvr::format
