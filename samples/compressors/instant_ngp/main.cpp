// instant_ngp encode RAW PACKED NX NY NZ BYTES [STEPS]
// instant_ngp decode PACKED RAW NX NY NZ
//
// Compresses an array of float32 voxels, x fastest, to at most BYTES by the method of Instant-NGP: a
// hash grid and a small network, whose parameters are stored as float16.

#include <cstdio>
#include <exception>
#include <stdexcept>
#include <string>

#include "model.h"

namespace {

constexpr unsigned long kMaxSide = 1ul << 20;
constexpr std::size_t kMaxVoxels = std::size_t{1} << 31;

unsigned long number(const std::string& text) {
  std::size_t end = 0;
  const unsigned long value = std::stoul(text, &end);
  if (end != text.size() || text[0] == '-' || value == 0) throw std::invalid_argument(text);
  return value;
}

ngp::Sides sidesOf(char** words) {
  ngp::Sides sides;
  for (int axis = 0; axis < 3; ++axis) {
    const unsigned long side = number(words[axis]);
    if (side > kMaxSide) throw std::runtime_error("a side has more than 2^20 voxels");
    sides[axis] = std::uint32_t(side);
  }
  if (ngp::voxelsOf(sides) > kMaxVoxels)
    throw std::runtime_error("the array has more than 2^31 voxels");
  return sides;
}

void encode(char** words, int count) {
  const ngp::Sides sides = sidesOf(words + 2);
  ngp::TrainOptions options;
  options.bytes = number(words[5]);
  if (count > 6) options.steps = std::uint32_t(number(words[6]));
  ngp::writeModel(words[1], ngp::train(ngp::readVoxels(words[0], sides), sides, options));
}

void decode(char** words) {
  const ngp::Stored model = ngp::readModel(words[0]);
  if (model.sides != sidesOf(words + 2)) throw std::runtime_error("the file has other sides");
  ngp::writeVoxels(words[1], ngp::evaluate(model));
}

int run(int count, char** words) {
  const std::string job = count > 1 ? words[1] : "";
  if (job == "encode" && (count == 8 || count == 9))
    encode(words + 2, count - 2);
  else if (job == "decode" && count == 7)
    decode(words + 2);
  else
    return std::fprintf(stderr,
                        "usage: instant_ngp encode RAW PACKED NX NY NZ BYTES [STEPS]\n"
                        "       instant_ngp decode PACKED RAW NX NY NZ\n"),
           2;
  return 0;
}

}  // namespace

int main(int count, char** words) {
  try {
    return run(count, words);
  } catch (const std::invalid_argument& error) {
    std::fprintf(stderr, "instant_ngp: sides, bytes and steps are whole numbers above 0\n");
  } catch (const std::exception& error) {
    std::fprintf(stderr, "instant_ngp: %s\n", error.what());
  }
  return 1;
}
