#include "images/stack_layout.h"

#include <sstream>
#include <string_view>

#include "cli/number.h"
#include "esvr/error.h"

namespace esvr::samples {
namespace {

/// The size of a stack as a text names it.
struct NamedStack {
  std::size_t channels = 1, slices = 1, frames = 1;
  bool channelsFirst = true;
  std::array<double, 3> voxelSize{1.0, 1.0, 1.0};

  [[nodiscard]] std::size_t pages() const { return channels * slices * frames; }
};

/// The value of a line "key=value".
std::optional<std::string> lineOf(const std::string& text, const std::string& key) {
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);)
    if (line.starts_with(key + "=")) return line.substr(key.size() + 1);
  return std::nullopt;
}

/// The value of an attribute `key="value"` of an XML element.
std::optional<std::string> attributeOf(const std::string& element, const std::string& key) {
  const std::string begin = " " + key + "=\"";
  const std::size_t at = element.find(begin);
  if (at == std::string::npos) return std::nullopt;
  const std::size_t value = at + begin.size();
  return element.substr(value, element.find('"', value) - value);
}

/// A positive count; 1 if there is none.
std::size_t countIn(const std::optional<std::string>& text) {
  constexpr std::int64_t kMost = 1 << 20;  // so that the product of three counts does not overflow
  const auto count = text ? cli::parseWhole(*text) : std::nullopt;
  return count && *count >= 1 && *count <= kMost ? std::size_t(*count) : 1;
}

/// A positive length; `otherwise` if there is none.
double lengthIn(const std::optional<std::string>& text, double otherwise) {
  const auto length = text ? cli::parseNumber(*text) : std::nullopt;
  return length && *length > 0.0 ? *length : otherwise;
}

NamedStack imageJStack(const StackFile& file) {
  NamedStack stack{.channels = countIn(lineOf(file.text, "channels")),
                   .slices = countIn(lineOf(file.text, "slices")),
                   .frames = countIn(lineOf(file.text, "frames"))};
  if (stack.pages() == 1) stack.slices = countIn(lineOf(file.text, "images"));
  for (std::size_t axis = 0; axis < file.resolution.size(); ++axis)
    if (file.resolution[axis] > 0.0) stack.voxelSize[axis] = 1.0 / file.resolution[axis];
  stack.voxelSize[2] = lengthIn(lineOf(file.text, "spacing"), stack.voxelSize[2]);
  return stack;
}

/// The first element of a name, without its content.
std::string elementIn(const std::string& text, const std::string& name) {
  const std::size_t begin = text.find("<" + name + " ");
  if (begin == std::string::npos) return {};
  return text.substr(begin, text.find('>', begin) - begin);
}

NamedStack omeStack(const std::string& text) {
  const std::string pixels = elementIn(text, "Pixels");
  // The colors of a page are counted as channels, but they are on one page.
  const std::size_t colors = countIn(attributeOf(elementIn(text, "Channel"), "SamplesPerPixel"));
  const std::size_t channels = countIn(attributeOf(pixels, "SizeC"));
  const auto order = attributeOf(pixels, "DimensionOrder").value_or("XYCZT");
  return {.channels = channels % colors == 0 ? channels / colors : channels,
          .slices = countIn(attributeOf(pixels, "SizeZ")),
          .frames = countIn(attributeOf(pixels, "SizeT")),
          .channelsFirst = order.find('C') < order.find('Z'),
          .voxelSize = {lengthIn(attributeOf(pixels, "PhysicalSizeX"), 1.0),
                        lengthIn(attributeOf(pixels, "PhysicalSizeY"), 1.0),
                        lengthIn(attributeOf(pixels, "PhysicalSizeZ"), 1.0)}};
}

bool isImageJ(const std::string& text) { return text.starts_with("ImageJ="); }

NamedStack namedStack(const StackFile& file) {
  if (isImageJ(file.text)) return imageJStack(file);
  if (file.text.find("<OME") != std::string::npos) return omeStack(file.text);
  return {.slices = file.pages};
}

std::string describe(const NamedStack& stack) {
  return std::to_string(stack.channels) + " channels of " + std::to_string(stack.slices) +
         " slices at " + std::to_string(stack.frames) + " times";
}

}  // namespace

std::optional<std::size_t> imageJPages(const std::string& text) {
  if (!isImageJ(text)) return std::nullopt;
  return countIn(lineOf(text, "images"));
}

StackLayout stackLayout(const StackFile& file) {
  NamedStack stack = namedStack(file);
  if (stack.pages() != file.pages)
    throw BadInput(file.path.string() + " has " + std::to_string(file.pages) +
                   " pages, but its description names " + describe(stack));
  if (stack.frames > 1 && stack.slices > 1)
    throw BadInput(file.path.string() + " changes over time (" + describe(stack) +
                   "); only a file of one time can be read");
  // Programs that know only one kind of stack call its slices times.
  return {.channels = stack.channels,
          .slices = stack.slices * stack.frames,
          .channelsFirst = stack.channelsFirst,
          .voxelSize = stack.voxelSize};
}

std::vector<std::size_t> pagesOf(const StackLayout& layout, std::size_t channel) {
  std::vector<std::size_t> pages;
  for (std::size_t slice = 0; slice < layout.slices; ++slice)
    pages.push_back(layout.channelsFirst ? slice * layout.channels + channel
                                         : channel * layout.slices + slice);
  return pages;
}

}  // namespace esvr::samples
