#include "cli/printable.h"

namespace esvr::cli {
namespace {

bool isControl(char c) {
  constexpr char kDelete = 0x7f;
  return (static_cast<unsigned char>(c) < ' ' && c != '\n') || c == kDelete;
}

}  // namespace

std::string printable(std::string text) {
  for (char& c : text)
    if (isControl(c)) c = '?';
  return text;
}

}  // namespace esvr::cli
