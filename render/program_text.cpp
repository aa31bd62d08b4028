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
         "samples, transfer function and compositing. Voxels are interpolated trilinearly. The\n"
         "voxels of an .esvr file are decoded when a ray needs them, and kept for the next\n"
         "picture. All are decoded before the first picture if the file stores voxels, a\n"
         "residual or an active mask.\n"
         "\n"
         "Positions and lengths are in voxels of the grid's index space; its transform is not\n"
         "applied. Samples whose value is exactly the background are transparent.\n"
         "A level set is drawn as an opaque body, whose faces differ in brightness by their angle\n"
         "to the rays, unless --colors, --opacity, --tf, --range or --mode is given.\n"
         "\n"
         "By default the projected box of the active voxels takes 90 % of the picture's width or\n"
         "height, whichever is tighter. In a turntable, no picture exceeds this, and all pictures\n"
         "have the same scale. With --bench, the sphere around the box touches the edges.\n"
         "\n" +
         listOf("Color maps", builtInColorMaps()) + listOf("Opacity curves", builtInOpacities()) +
         "\n"
         "CAM.json has the values of the camera options: {\"eye\": [1, 2, 3], \"center\": [...],\n"
         "\"up\": [...], \"fov\": 30}, or \"height\" for an orthographic camera.\n"
         "\n"
         "A turntable writes OUT.0000.png, OUT.0001.png and so on. %04d in the name of an output\n"
         "stands for the number. If OUT is a folder, or ends in '/', the pictures are\n"
         "OUT/frame.0000.png and so on. If it ends in .mp4 or .webm, the program ffmpeg, which "
         "must\n"
         "be in PATH, encodes a video. A video shows the background; the default is black.\n"
         "\n"
         "If IN.esvr holds a sequence, each frame becomes a picture with the number of the frame\n"
         "in place of the pattern in OUT, or a picture of the video. All have one camera and one\n"
         "range of values, which are those of all frames together.\n"
         "\n"
         "--legend shows the color of each value and, in a second column in front of a\n"
         "checkerboard, its opacity over --opacity-length. The unit is the text of the grid's\n"
         "metadata \"unit\" or \"units\". A fitted camera leaves room for the bar. It is not "
         "drawn\n"
         "into EXR pictures, and the errors of --ref are measured without it.\n"
         "\n"
         "--with draws further grids of IN, which must have the same transform, for example a\n"
         "temperature that glows within a density. Behind the NAME of a grid, ':' separates parts\n"
         "of its LOOK: colors=MAP (default: inferno), opacity=CURVE, tf=FILE, preset=NAME and\n"
         "range=R, as for the options of these names, and emission, with which the grid emits "
         "light\n"
         "but hides nothing. Where grids overlap, their extinctions add up. Voxels are drawn "
         "without\n"
         "levels of detail. --legend and --tf-save show the first grid. In a transparent PNG, "
         "light\n"
         "beyond the opacity raises alpha; an EXR file holds it as it is.\n"
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
  return {
      .name = kProgram,
      .purpose =
          "Draws a picture of an .esvr file, or of a VDB for comparison, through a transfer\n"
          "function. The ellipsoids of an .esvr file are drawn directly, without decoding the\n"
          "whole grid to voxels first.",
      .usage =
          "  esvr-render IN.esvr OUT.png|OUT.exr [OPTION]...\n"
          "  esvr-render IN.vdb OUT.png|OUT.exr [OPTION]...\n"
          "  esvr-render IN.esvr OUT.####.png|OUT.mp4 [--frames 1-100] [OPTION]...\n"
          "  esvr-render IN OUT.mp4|OUT.webm|FOLDER/ --turntable N [OPTION]...\n"
          "  esvr-render IN.esvr --bench [--ref IN.vdb] [--report FILE.json] [OPTION]...",
      .notes = notes(),
      .examples =
          "  esvr-render smoke.esvr smoke.png\n"
          "  esvr-render smoke.vdb reference.png              # the original, to compare\n"
          "  esvr-render smoke.esvr smoke.png --colors inferno --opacity-length 4\n"
          "  esvr-render smoke.esvr smoke.png --tf presets.json --preset Smoke\n"
          "  esvr-render fire.esvr fire.png --grid density --colors grayscale \\\n"
          "              --with temperature:colors=black-body:emission\n"
          "  esvr-render smoke.esvr turn.png --turntable 36   # turn.0000.png to turn.0035.png\n"
          "  esvr-render smoke.esvr turn.mp4 --turntable 120 --fps 24\n"
          "  esvr-render smoke.esvr 'out.####.png' --frames 1-100   # frames of a sequence\n"
          "  esvr-render smoke.esvr --bench --ref smoke.vdb   # speed, memory, quality"};
}

}  // namespace esvr::render
