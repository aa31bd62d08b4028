// Reads ParaView presets in JSON and in XML. A preset that is accepted is a valid transfer
// function.

#include <cstdint>

#include "esvr/error.h"
#include "esvr/transfer_function.h"
#include "fuzz/input_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static esvr::fuzz::InputFile file(".json");
  try {
    const auto function = esvr::readParaViewPreset(file.write(data, size), "");
    esvr::checkTransferFunction(function);
    for (const double x : {-1e300, 0.0, 0.5, 1e300}) {
      (void)esvr::colorAt(function.colors, x);
      (void)esvr::opacityAt(function.opacity, x);
    }
  } catch (const esvr::BadInput&) {
  }
  return 0;
}
