#include "volume.h"

#include <cstring>
#include <fstream>
#include <iterator>
#include <stdexcept>

namespace ngp {
namespace {

constexpr char kMagic[8] = {'n', 'g', 'p', '-', 'v', 'o', 'l', '1'};

std::vector<char> readFile(const std::string& path) {
  std::ifstream stream(path, std::ios::binary);
  if (!stream) throw std::runtime_error("cannot read '" + path + "'");
  return {std::istreambuf_iterator<char>(stream), {}};
}

template <class T>
void put(std::ofstream& stream, const T* values, std::size_t count) {
  stream.write(reinterpret_cast<const char*>(values), std::streamsize(count * sizeof(T)));
}

std::ofstream openForWriting(const std::string& path) {
  std::ofstream stream(path, std::ios::binary);
  if (!stream) throw std::runtime_error("cannot write '" + path + "'");
  return stream;
}

void close(std::ofstream& stream, const std::string& path) {
  stream.close();
  if (!stream) throw std::runtime_error("cannot write '" + path + "'");
}

bool isKnown(const Shape& shape) {
  const bool hasNeurons = shape.neurons == 16 || shape.neurons == 32 || shape.neurons == 64;
  return hasNeurons && shape.levels >= 1 && shape.levels <= kMostLevels &&
         shape.tableBits <= kMostTableBits;
}

}  // namespace

std::size_t voxelsOf(const Sides& sides) { return std::size_t(sides[0]) * sides[1] * sides[2]; }

std::vector<float> readVoxels(const std::string& path, const Sides& sides) {
  const std::vector<char> bytes = readFile(path);
  std::vector<float> voxels(voxelsOf(sides));
  if (bytes.size() != voxels.size() * sizeof(float))
    throw std::runtime_error("'" + path + "' has " + std::to_string(bytes.size()) + " bytes, not " +
                             std::to_string(voxels.size() * sizeof(float)));
  std::memcpy(voxels.data(), bytes.data(), bytes.size());
  return voxels;
}

void writeVoxels(const std::string& path, const std::vector<float>& voxels) {
  std::ofstream stream = openForWriting(path);
  put(stream, voxels.data(), voxels.size());
  close(stream, path);
}

void writeModel(const std::string& path, const Stored& model) {
  std::ofstream stream = openForWriting(path);
  const std::uint32_t shape[] = {model.shape.levels, model.shape.tableBits, model.shape.neurons};
  put(stream, kMagic, sizeof kMagic);
  put(stream, model.sides.data(), 3);
  put(stream, shape, 3);
  put(stream, &model.peak, 1);
  put(stream, model.parameters.data(), model.parameters.size());
  close(stream, path);
}

Stored readModel(const std::string& path) {
  const std::vector<char> bytes = readFile(path);
  if (bytes.size() < kHeaderBytes || std::memcmp(bytes.data(), kMagic, sizeof kMagic) != 0)
    throw std::runtime_error("'" + path + "' is no file of instant_ngp");
  Stored model;
  std::uint32_t words[6];
  std::memcpy(words, bytes.data() + sizeof kMagic, sizeof words);
  model.sides = {words[0], words[1], words[2]};
  model.shape = {words[3], words[4], words[5]};
  if (!isKnown(model.shape)) throw std::runtime_error("'" + path + "' has an unknown model");
  std::memcpy(&model.peak, bytes.data() + sizeof kMagic + sizeof words, sizeof model.peak);
  model.parameters.resize((bytes.size() - kHeaderBytes) / sizeof(std::uint16_t));
  std::memcpy(model.parameters.data(), bytes.data() + kHeaderBytes,
              model.parameters.size() * sizeof(std::uint16_t));
  return model;
}

}  // namespace ngp
