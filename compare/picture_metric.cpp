#include "compare/picture_metric.h"

#include <span>
#include <sstream>
#include <utility>

#include "cli/bytes_file.h"
#include "cli/number.h"
#include "cli/shell_word.h"
#include "compare/shell_command.h"
#include "esvr/error.h"
#include "report/png_image.h"

namespace esvr::compare {
namespace {

std::filesystem::path written(const Image& image, const std::filesystem::path& path) {
  constexpr bool kOverwrite = true;
  const std::string png = report::toPng(image);
  cli::writeBytes(path, std::as_bytes(std::span(png)), kOverwrite);
  return path;
}

double lastNumber(const std::string& command, const std::string& text) {
  std::istringstream words(text);
  std::string word, last;
  while (words >> word) last = word;
  const auto value = cli::parseNumber(last);
  if (!value)
    throw RuntimeFailure("--lpips: " + command + " printed '" + last + "', which is not a number");
  return *value;
}

}  // namespace

PictureMetric::PictureMetric(std::string command, std::filesystem::path folder)
    : command_(std::move(command)), folder_(std::move(folder)) {}

double PictureMetric::of(const Image& reference, const Image& picture) const {
  const auto command = command_ + " " +
                       cli::shellWord(written(reference, folder_ / "reference.png").string()) +
                       " " + cli::shellWord(written(picture, folder_ / "picture.png").string());
  return lastNumber(command_, outputOf(command, "--lpips"));
}

}  // namespace esvr::compare
