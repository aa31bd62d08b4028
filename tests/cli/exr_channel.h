#pragma once
/// Reads the pictures of a program with OpenEXR.

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <vector>

namespace esvr::test {

/// One channel of an EXR, row after row.
inline std::vector<float> readExr(const std::filesystem::path& path, const char* channel) {
  Imf::InputFile file(path.c_str());
  const Imath::Box2i window = file.header().dataWindow();
  const std::size_t width = std::size_t(window.max.x) + 1, height = std::size_t(window.max.y) + 1;
  EXPECT_NE(file.header().channels().findChannel(channel), nullptr);
  std::vector<float> values(width * height);
  Imf::FrameBuffer buffer;
  buffer.insert(channel, Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(values.data()),
                                    sizeof(float), sizeof(float) * width));
  file.setFrameBuffer(buffer);
  file.readPixels(0, window.max.y);
  return values;
}

}  // namespace esvr::test
