#include "render/program_text.h"

#include "esvr/transfer_function.h"
#include "render/options.h"

namespace esvr::render {
namespace {

/// "title: one, two, three."
std::string listOf(const std::string& title, const std::vector<std::string>& names) {
  std::string text = title + ":";
  for (const std::string& name : names) text += " " + name + ",";
  text.back() = '.';
  return text;
}

std::string notes() {
  return "IN may be an .esvr, a .vdb or an .nvdb file. All are drawn with the same camera, "
         "samples, "
         "transfer function and compositing.\n"
         "\n" +
         listOf("Color maps", builtInColorMaps()) + " " +
         listOf("Opacity curves", builtInOpacities()) +
         "\n"
         "\n"
         "A turntable writes OUT.0000.png, OUT.0001.png and so on, and a sequence a picture of "
         "each "
         "frame. If OUT ends in .mp4 or .webm, the program ffmpeg, which must be in PATH, encodes "
         "a "
         "video.\n"
         "\n"
         "Exit codes: 0 done, 1 failure, 2 wrong options, 3 input that is damaged or cannot be "
         "used, 5 no such device or not enough memory (--max-memory, --max-vram).";
}

constexpr const char* kDetails =
    "IN may be - for standard input, or a pipe. Voxels are interpolated trilinearly. The voxels of "
    "an .esvr file are decoded when a ray needs them, and kept for the next picture. All are "
    "decoded before the first picture if the file stores voxels, a residual or an active mask.\n"
    "\n"
    "Positions and lengths are in voxels of the grid's index space; its transform is not applied. "
    "Samples whose value is exactly the background are transparent. A level set is drawn as an "
    "opaque body, whose faces differ in brightness by their angle to the rays, unless --colors, "
    "--opacity, --tf, --range or --mode is given.\n"
    "\n"
    "By default the projected box of the active voxels takes 90 % of the picture's width or "
    "height, whichever is tighter. In a turntable, no picture exceeds this, and all pictures have "
    "the same scale. With --bench, the sphere around the box touches the edges.\n"
    "\n"
    "CAM.json has the values of the camera options: {\"eye\": [1, 2, 3], \"center\": [...], "
    "\"up\": [...], \"fov\": 30}, or \"height\" for an orthographic camera.\n"
    "\n"
    "%04d in the name of an output stands for the number of a picture. If OUT is a folder, or ends "
    "in '/', the pictures are OUT/frame.0000.png and so on. A video shows the background; the "
    "default is black.\n"
    "\n"
    "If IN.esvr holds a sequence, or IN is a pattern such as smoke.####.vdb, each frame becomes a "
    "picture with the number of the frame in place of the pattern in OUT, or a picture of the "
    "video. All have one camera and one range of values, which are those of all frames together.\n"
    "\n"
    "--legend shows the color of each value and, in a second column in front of a checkerboard, "
    "its opacity over --opacity-length. The unit is the text of the grid's metadata \"unit\" or "
    "\"units\". A fitted camera leaves room for the bar. It is not drawn into EXR pictures, and "
    "the errors of --ref are measured without it.\n"
    "\n"
    "--with draws further grids of IN, which must have the same transform, for example a "
    "temperature that glows within a density. Behind the NAME of a grid, ':' separates parts of "
    "its LOOK: colors=MAP (default: inferno), opacity=CURVE, tf=FILE, preset=NAME and range=R, as "
    "for the options of these names, and emission, with which the grid emits light but hides "
    "nothing. Where grids overlap, their extinctions add up. Voxels are drawn without levels of "
    "detail. --legend and --tf-save show the first grid. In a transparent PNG, light beyond the "
    "opacity raises alpha; an EXR file holds it as it is.\n"
    "\n"
    "--ref also draws the voxels of a VDB with the same camera, on the same device, and prints the "
    "error of each picture. OUT.error.png shows ten times the error. --bench draws a full turn, "
    "writes no picture, and reports the frames per second and the times of the parts of a frame; "
    "with --ref it does so for both files.\n"
    "\n"
    "A PNG file holds sRGB colors that are not premultiplied by alpha. An EXR file holds floats in "
    "linear light that are premultiplied. Both hold the command line in their metadata.";

}  // namespace

cli::ProgramText programText() {
  return {
      .name = kProgram,
      .purpose =
          "Draws a picture of an .esvr file, or of a VDB for comparison, through a transfer "
          "function. The ellipsoids of an .esvr file are drawn directly, without decoding the "
          "whole grid to voxels first.",
      .usage =
          "  esvr-render IN.esvr OUT.png|OUT.exr [OPTION]...\n"
          "  esvr-render IN.vdb OUT.png|OUT.exr [OPTION]...\n"
          "  esvr-render IN.esvr|IN.####.vdb OUT.####.png|OUT.mp4 [--frames 1-100] [OPTION]...\n"
          "  esvr-render IN OUT.mp4|OUT.webm|FOLDER/ --turntable N [OPTION]...\n"
          "  esvr-render IN.esvr --bench [--ref IN.vdb] [--report FILE.json] [OPTION]...",
      .notes = notes(),
      .details = kDetails,
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
