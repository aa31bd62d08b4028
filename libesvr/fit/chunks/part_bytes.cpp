#include <cstring>
#include <type_traits>

#include "esvr/error.h"
#include "fit/chunks/part.h"

namespace esvr {
namespace {

template <class T>
concept Plain = std::is_trivially_copyable_v<T>;

class BytesOut {
 public:
  template <Plain T>
  void operator()(const T& value) {
    append(std::as_bytes(std::span(&value, 1)));
  }
  template <Plain T>
  void operator()(const std::vector<T>& values) {
    (*this)(std::uint64_t{values.size()});
    append(std::as_bytes(std::span(values)));
  }
  std::vector<std::byte> take() { return std::move(bytes_); }

 private:
  void append(std::span<const std::byte> bytes) {
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
  }
  std::vector<std::byte> bytes_;
};

class BytesIn {
 public:
  explicit BytesIn(std::span<const std::byte> bytes) : left_(bytes) {}

  template <Plain T>
  void operator()(T& value) {
    std::memcpy(&value, next(sizeof value).data(), sizeof value);
  }
  template <Plain T>
  void operator()(std::vector<T>& values) {
    std::uint64_t count = 0;
    (*this)(count);
    if (count > left_.size() / sizeof(T)) fail();
    values.resize(count);
    const auto bytes = next(count * sizeof(T));
    if (count > 0) std::memcpy(values.data(), bytes.data(), bytes.size());
  }
  void finish() const {
    if (!left_.empty()) fail();
  }

 private:
  [[noreturn]] static void fail() { throw BadInput("the result of a part is damaged"); }
  std::span<const std::byte> next(std::size_t count) {
    if (count > left_.size()) fail();
    const auto bytes = left_.first(count);
    left_ = left_.subspan(count);
    return bytes;
  }
  std::span<const std::byte> left_;
};

/// Passes all members to a writer or a reader, in the same order.
void passAll(auto& bytes, auto& part) {
  bytes(part.fit.ellipsoids);
  bytes(part.fit.adam);
  bytes(part.kernel.form);
  bytes(part.kernel.kappa);
  bytes(part.kernel.epsilon);
  bytes(part.errors.squaredSum);
  bytes(part.errors.squaredSumBox);
  bytes(part.errors.squaredSumActive);
  bytes(part.errors.largest);
  bytes(part.pairs);
  bytes(part.end);
  bytes(part.iterations);
  bytes(part.deviceBytes);
  bytes(part.deviceFull);
  bytes(part.secondsSeed);
}

}  // namespace

std::vector<std::byte> bytesOf(const PartEnd& end) {
  BytesOut out;
  passAll(out, end);
  return out.take();
}

PartEnd partOf(std::span<const std::byte> bytes) {
  PartEnd end;
  BytesIn in(bytes);
  passAll(in, end);
  in.finish();
  if (end.fit.ellipsoids.size() != end.fit.adam.size() || end.end > FitEnd::kPsnrMissed)
    throw BadInput("the result of a part is damaged");
  return end;
}

}  // namespace esvr
