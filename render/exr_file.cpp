#include "render/image_files.h"

#include <Iex.h>
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfOutputFile.h>
#include <ImfStandardAttributes.h>
#include <ImfStringAttribute.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "esvr/error.h"

namespace esvr::render {
namespace {

using Bytes = std::vector<std::byte>;
constexpr std::size_t kExrChannels = 4;

/// An output file in memory. It can seek, because OpenEXR goes back to fill in its line table.
class ByteStream final : public Imf::OStream {
 public:
  ByteStream() : Imf::OStream("a picture") {}

  void write(const char c[], int n) override {
    bytes_.resize(std::max(bytes_.size(), at_ + std::size_t(n)));
    std::memcpy(&bytes_[at_], c, std::size_t(n));
    at_ += std::size_t(n);
  }
  std::uint64_t tellp() override { return at_; }
  void seekp(std::uint64_t pos) override { at_ = pos; }
  [[nodiscard]] Bytes take() { return std::move(bytes_); }

 private:
  Bytes bytes_;
  std::size_t at_ = 0;
};

/// Converts an sRGB channel to linear light (IEC 61966-2-1).
float linearLight(float color) {
  return color <= 0.04045f ? color / 12.92f : std::pow((color + 0.055f) / 1.055f, 2.4f);
}

std::vector<float> linearPixels(const Image& image) {
  std::vector<float> pixels = image.rgba;
  for (std::size_t i = 0; i < pixels.size(); i += kExrChannels) {
    const float alpha = pixels[i + 3];
    for (std::size_t c = 0; c < 3; ++c)
      pixels[i + c] = alpha > 0.0f ? alpha * linearLight(pixels[i + c] / alpha) : 0.0f;
  }
  return pixels;
}

/// The distances of a depth picture, stored in the first of every four floats as in its pixels.
std::vector<float> depths(const Image& image) {
  std::vector<float> pixels = image.rgba;
  for (std::size_t i = 0; i < pixels.size(); i += kExrChannels)
    if (pixels[i + 3] == 0.0f) pixels[i] = std::numeric_limits<float>::infinity();
  return pixels;
}

Bytes written(const Image& image, std::vector<float> pixels,
              const std::vector<const char*>& channels, const PictureText& text) {
  Imf::Header header(image.width, image.height);
  Imf::addComments(header, text.comment);
  header.insert("software", Imf::StringAttribute(text.software));
  Imf::FrameBuffer buffer;
  const std::size_t ofPixel = kExrChannels * sizeof(float);
  for (std::size_t c = 0; c < channels.size(); ++c) {
    header.channels().insert(channels[c], Imf::Channel(Imf::FLOAT));
    buffer.insert(channels[c], Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(&pixels[c]), ofPixel,
                                          ofPixel * std::size_t(image.width)));
  }
  ByteStream stream;
  {
    Imf::OutputFile file(stream, header);
    file.setFrameBuffer(buffer);
    file.writePixels(image.height);
  }  // the destructor writes the line table
  return stream.take();
}

Bytes writtenOrFailed(const Image& image, std::vector<float> pixels,
                      const std::vector<const char*>& channels, const PictureText& text) {
  try {
    return written(image, std::move(pixels), channels, text);
  } catch (const Iex::BaseExc& error) {
    throw RuntimeFailure(std::string("OpenEXR: ") + error.what());
  }
}

}  // namespace

Bytes encodeExr(const Image& image, const PictureText& text) {
  return writtenOrFailed(image, linearPixels(image), {"R", "G", "B", "A"}, text);
}

Bytes encodeDepthExr(const Image& image, const PictureText& text) {
  return writtenOrFailed(image, depths(image), {"Z"}, text);
}

}  // namespace esvr::render
