#include "render/program_text.h"

#include "esvr/transfer_function.h"
#include "render/options.h"

namespace esvr::render {
namespace {

/// Formats "title: one, two, three." for a help text, with line breaks.
std::string listOf(const std::string& title, const std::vector<std::string>& names) {
  constexpr std::size_t kLine = 80;
  std::string text, line = title + ":";
  for (std::size_t i = 0; i < names.size(); ++i) {
    const std::string word = " " + names[i] + (i + 1 < names.size() ? "," : ".");
    if (line.size() + word.size() > kLine) text += line + "\n", line = " ";
    line += word;
  }
  return text + line + "\n";
}

std::string notes() {
  return "IN may be an .esvr, a .vdb or an .nvdb file. All are drawn with the same camera,\n"
         "samples, transfer function and compositing. Voxels are interpolated trilinearly. An\n"
         ".esvr file that stores voxels is drawn from these voxels. A residual and a stored\n"
         "active mask are drawn with --method bricks only.\n"
         "\n"
         "Positions and lengths are in voxels of the grid's index space; its transform is not\n"
         "applied. By default the camera sees all active voxels. Samples whose value is exactly\n"
         "the background are transparent. A level set is drawn as an opaque body, whose faces "
         "differ\n"
         "in brightness by their angle to the rays, unless --colors, --opacity, --tf, --range or\n"
         "--mode is given.\n"
         "\n" +
         listOf("Color maps", builtInColorMaps()) + listOf("Opacity curves", builtInOpacities()) +
         "\n"
         "CAM.json has the values of the camera options: {\"eye\": [1, 2, 3], \"center\": [...],\n"
         "\"up\": [...], \"fov\": 30}, or \"height\" for an orthographic camera.\n"
         "\n"
         "--ref also draws the voxels of a VDB with the same camera, on the same device, and\n"
         "prints the error of each picture. OUT.error.png shows ten times the error.\n"
         "--bench draws a full turn, writes no picture, and reports the frames per second and the\n"
         "times of the parts of a frame; with --ref it does so for both files.\n"
         "\n"
         "A PNG file holds sRGB colors that are not premultiplied by alpha. An EXR file holds\n"
         "floats in linear light that are premultiplied. Both hold the command line in their\n"
         "metadata.\n"
         "\n"
         "Exit codes: 0 done, 1 failure, 2 wrong options, 3 input that is damaged or cannot be\n"
         "used, 5 no such device or not enough memory (--max-memory, --max-vram).";
}

}  // namespace

cli::ProgramText programText() {
  return {.name = kProgram,
          .purpose =
              "Draws a picture of an .esvr file, or of a VDB for comparison, through a transfer\n"
              "function. The ellipsoids of an .esvr file are drawn directly, without decoding the\n"
              "whole grid to voxels first.",
          .usage =
              "  esvr-render IN.esvr OUT.png|OUT.exr [OPTION]...\n"
              "  esvr-render IN.vdb OUT.png|OUT.exr [OPTION]...\n"
              "  esvr-render IN.esvr --bench [--ref IN.vdb] [--report FILE.json] [OPTION]...",
          .notes = notes(),
          .examples =
              "  esvr-render smoke.esvr smoke.png\n"
              "  esvr-render smoke.vdb reference.png              the original, to compare\n"
              "  esvr-render smoke.esvr smoke.png --colors inferno --opacity-length 4\n"
              "  esvr-render smoke.esvr smoke.png --tf presets.json --preset Smoke\n"
              "  esvr-render smoke.esvr turn.png --turntable 36   turn.0000.png to turn.0035.png\n"
              "  esvr-render smoke.esvr --bench --ref smoke.vdb   speed, memory, quality"};
}

}  // namespace esvr::render
