// What `vdb2esvr --help` says, and the options that the program has.
#include "vdb2esvr/options.h"

#include "esvr/encode.h"
#include "programs/command_line.h"
#include "programs/option_values.h"
#include "programs/resources.h"
#include "programs/run_main.h"
#include "programs/sequence.h"
#include "programs/splat_input.h"

namespace esvr::vdb2esvr {
namespace {

using cli::po::bool_switch;
using cli::po::value;

cli::ProgramText programText() {
  return {
      .name = kProgram,
      .purpose =
          "Fits ellipsoids to the sparse grids of a VDB file and writes them to an .esvr file. A "
          "pattern such as smoke.####.vdb stands for the files of a sequence. esvr2vdb converts "
          "the file back to VDB. Transforms, names and metadata are then exactly those of the "
          "source, and voxels have the chosen accuracy.",
      .usage =
          "  vdb2esvr IN.vdb OUT.esvr [-g NAME]... [--size 50KB | --psnr DB | --count N]\n"
          "  vdb2esvr IN.ply OUT.esvr [--voxel-size S] [--density-scale D] [--up A] ...\n"
          "  vdb2esvr IN.####.vdb OUT.####.esvr|OUT.esvr [--frames 1-100x2] ...",
      .notes =
          "Without a goal, each grid gets the quality of --preset in as few bytes as were found. "
          "For each grid, the program chooses between ellipsoids and quantised voxels. With "
          "--count there is a single fit.\n"
          "\n"
          "Without -g, all grids are converted. Grids that cannot be fitted, such as integers, "
          "masks and points, come back bit for bit.\n"
          "\n"
          "The program prints a table on stdout. Its PSNR and largest error are measured on the "
          "voxels that are decoded from the written file. Ctrl-C ends the run within two seconds "
          "and writes the best result so far. OUT.esvr is never incomplete.\n"
          "\n"
          "In a pattern, #, #### and %04d are four digits, and @ is as many as needed. If OUT has "
          "one, each frame of a sequence is converted to a file of its own; otherwise OUT.esvr "
          "holds all frames.\n"
          "\n"
          "Exit codes: 0 done, 1 failure or interrupted, 2 wrong options, 3 unusable input, 4 "
          "--psnr not reached (the file is written), 5 no such device or not enough memory "
          "(--max-memory, --max-vram).",
      .details =
          "IN.vdb may be - for standard input, or a pipe such as <(...). Its bytes are copied to a "
          "file in the folder of --scratch, which has no name. If an input changes while it is "
          "read, the run fails.\n"
          "\n"
          "IN may also be a .ply file of 3D Gaussian splats. Its density is evaluated at voxels of "
          "--voxel-size, and converted like a .vdb file with the grid \"density\" and, with "
          "colors, the vectors \"Cd\" (docs/splats.md).\n"
          "\n"
          "Grids of vectors are fitted by components, unless they take fewer bytes unchanged. "
          "Grids that are not fitted are carried in the file as the bytes that OpenVDB wrote: "
          "those that are not of floats, doubles or vectors of them, those without an active "
          "voxel, and those that --keep names. The summary says what was fitted, carried and left "
          "out. A grid of a .nvdb file cannot be carried; a file with one that cannot be fitted "
          "either is refused, unless --skip names it.\n"
          "\n"
          "--effort says how long a conversion may take: each step makes fits 1.6 times as long, "
          "and "
          "1 makes none where voxels need many bits (docs/convert.md). On the CPU, fits of large "
          "grids are "
          "shorter, and efforts above 5 lengthen these alone; where they would be too short, "
          "voxels are stored, and the summary says so. With --size and --ratio, several grids "
          "get one quality, the highest one that is found to keep to the size, and the bytes of "
          "carried grids count. A frame of a sequence without active voxels has no size. With "
          "--psnr, --count limits the number of ellipsoids. The program makes only a short fit if "
          "that shows that voxels are better. --representation prescribes one of them.\n"
          "\n"
          "With --count, --seconds or --iterations there is a single fit. Its ellipsoids are "
          "stored unless exact voxels take no more bytes. With --psnr and --seconds, it ends as "
          "soon as it reaches the PSNR.\n"
          "\n"
          "Grids with the same voxels are converted and stored once. The voxels of other grids of "
          "one transform refer to each other where that takes fewer bytes, such as those of a "
          "temperature to a density, and small parts of the file are stored together (--share).\n"
          "\n"
          "Ctrl-C and SIGTERM end the run within two seconds, and the exit code is 1. A message "
          "says so if completing the best result so far takes longer. A second Ctrl-C ends the "
          "program at once. With --resume, nothing but the finished parts is kept, and the same "
          "command continues the run.\n"
          "\n"
          "A file with all frames of a sequence has groups of 16 frames. A frame whose grids "
          "differ from those of the frame before it begins a group. Until the file is complete, it "
          "has the name OUT.esvr.partial. Without a goal, all frames have the PSNR of --preset, "
          "whatever their size. A file of one frame does not depend on other frames. In OUT, only "
          "the name of the file may have a pattern; folders stand for themselves.\n"
          "\n"
          "Frames are converted at the same time on the threads of --threads, or up to four on "
          "each GPU of --device, as far as --max-memory allows. A frame that fails is named, and "
          "does not stop the others (--on-error stop); the exit code is that of the first one. "
          "Ctrl-C keeps the frames that are complete, or the groups that are complete in one file. "
          "With --resume, they are not converted again, unless their inputs have changed.\n"
          "\n"
          "mpirun -n N vdb2esvr ... fits the chunks of a volume on N processes, if the program was "
          "built with MPI. All devices and processes together write the bytes that one writes.",
      .examples =
          "  vdb2esvr smoke.vdb smoke.esvr                       # a small file of good quality\n"
          "  vdb2esvr smoke.vdb smoke.esvr --size 100KB          # the best file of 100 KB\n"
          "  vdb2esvr smoke.vdb smoke.esvr --psnr 45             # the smallest file with 45 dB\n"
          "  vdb2esvr smoke.vdb smoke.esvr -g density --count 12000 --report fit.json\n"
          "  vdb2esvr frame.vdb frame.esvr --skip velocity       # all grids but one\n"
          "  vdb2esvr ct.vdb ct.esvr --max-error 0.5%            # every voxel within the bound\n"
          "  vdb2esvr ocean.vdb ocean.esvr --nonfinite keep      # NaN comes back where it was\n"
          "  vdb2esvr big.vdb big.esvr --count 2000000 --max-vram 4GB --resume\n"
          "  vdb2esvr ct.vdb ct.esvr --seconds 30 --box 0,0,0,255,255,255\n"
          "  vdb2esvr 'smoke.####.vdb' 'smoke.####.esvr' --frames 1-100 --missing hold\n"
          "  vdb2esvr 'smoke.####.vdb' smoke.esvr                # all frames in one file\n"
          "  vdb2esvr splats.ply splats.esvr --voxel-size 1      # the density of splats"};
}

void addGoalOptions(cli::po::options_description& options) {
  // clang-format off
  options.add_options()
    ("count", value<std::int64_t>()->value_name("N"),
     "number of ellipsoids; with --psnr, the largest number")
    ("size", value<std::string>()->value_name("BYTES"),
     "write the best file of at most this size: 50000, 50KB, 2.6MB")
    ("ratio", value<double>()->value_name("R"),
     "write the best file of at most the size of IN.vdb divided by R")
    ("psnr", value<std::string>()->value_name("DB"),
     "write the smallest file that reaches this PSNR over the box; NAME=DB is that of one grid: "
     "density=50,temperature=40, or 40,density=50 with 40 for all others")
    ("picture-psnr", value<double>()->value_name("DB"),
     "write the smallest file whose transmittance has this PSNR (column PSNR T 0.5), for grids that are "
     "looked through; other grids have the quality of --preset")
    ("lossless", bool_switch(),
     "store voxels and active mask bit for bit, without ellipsoids; grids that have other inactive "
     "values than the background are carried unchanged")
    ("max-error", value<std::string>()->value_name("E"),
     "keep the error of every voxel within E, or within E% of the range of the active values (of vectors: of the component with the largest range); NAME=E is the "
     "bound of one grid, as with --psnr; voxels are stored")
    ("max-relative-error", value<std::string>()->value_name("E[,F]"),
     "keep the error of every voxel within the share E of its magnitude, such as 1%, or of the magnitude F "
     "where it is smaller (default: the smallest one above 0, at least 1.2e-38); voxels are stored")
    ("representation", value<std::string>()->value_name("R")->default_value("auto"),
     "ellipsoids, voxels, or auto (whichever are better or smaller)")
    ("measure", value<std::string>()->value_name("M")->default_value("auto"),
     "what the quality of --preset, --size and --ratio means. auto: what is seen of fog volumes, and the "
     "PSNR of values for all other grids; values: the PSNR of values for all grids")
    ("tone", value<std::string>()->value_name("S")->default_value("auto"),
     "code values v as S asinh(v / S), so that faint smoke keeps its shape beside dense smoke. auto: "
     "where the measure is what is seen and it pays; off: never; or the scale S, in units of the values, for "
     "all grids with a background of 0")
    ("topology", value<std::string>()->value_name("T")->default_value("auto"),
     "how active voxels are stored. auto: by their values, so that voxels that differ from the "
     "background by no more than the error may become inactive; their bounding box stays, and level "
     "sets keep their band, and vectors their active voxels; exact: by their mask, which takes more bytes");
  // clang-format on
}

void addFitOptions(cli::po::options_description& options) {
  // clang-format off
  options.add_options()
    ("seconds", value<double>()->value_name("S"), "end the fit of each grid after this time")
    ("iterations", value<std::int64_t>()->value_name("N"), "number of iterations of a fit")
    ("preset", value<std::string>()->value_name("P")->default_value("standard"),
     "quality without another target: draft, standard or high stand for a PSNR of 30, 38 or 48 dB of the "
     "transmittance of fog volumes, and of 32, 40 or 50 dB over the active voxels of other grids; in a single fit, the count and the iterations that are not given")
    ("effort", value<std::int64_t>()->value_name("E")->default_value(std::int64_t(kUsualEffort)),
     "time to take, from 1 (shortest) to 9 (longest)")
    ("box", value<std::string>()->value_name("BOX"),
     "box of voxels x0,y0,z0,x1,y1,z1 over which PSNR is measured (default: the bounding box of "
     "the active voxels)")
    ("seed", value<std::int64_t>()->value_name("N")->default_value(std::int64_t(FitOptions{}.seed)),
     "seed of the random choices; the same seed gives the same file")
    ("storage", value<std::string>()->value_name("S")->default_value("compact"),
     "compact (quantised, 7 to 12 bytes per ellipsoid) or float32 (about 34)")
    ("paper", value<std::vector<std::string>>()->value_name("KEY=VALUE,...")->composing(),
     "fit by the paper's method, for comparison; --help paper lists the keys");
  // clang-format on
  cli::addDevice(options, {}, "; cuda:0,1 or cuda:all fit the chunks of a volume on several GPUs");
  // clang-format off
  options.add_options()
    ("max-vram", value<std::string>()->value_name("BYTES"),
     "GPU memory to use, for example 4GB or 64MB; a number below 1000000 without a unit is one of GB "
     "(default: all free memory); a volume that does not fit is fitted in chunks")
    ("chunk-voxels", value<std::int64_t>()->value_name("N"),
     "fit the volume in chunks of about N active voxels (default: one chunk if it fits)");
  // clang-format on
}

void addFileOptions(cli::po::options_description& options) {
  // clang-format off
  options.add_options()
    ("grid,g", value<std::vector<std::string>>()->value_name("NAME")->composing(),
     "convert this grid only; may be repeated; 'density[1]' is the second grid of that name "
     "(docs/convert.md has all rules)")
    ("keep", value<std::vector<std::string>>()->value_name("NAME")->composing(),
     "carry this grid unchanged instead of fitting it; may be repeated; with -g, in addition to the "
     "grids that -g names")
    ("skip", value<std::vector<std::string>>()->value_name("NAME")->composing(),
     "leave this grid out; may be repeated")
    ("share", value<std::string>()->value_name("W")->default_value("auto"),
     "auto: grids of one transform refer to each other where that makes the file smaller, and small "
     "parts of the file are stored together; off: each grid is stored on its own")
    ("nonfinite", value<std::string>()->value_name("W")->default_value("refuse"),
     "refuse: fail on NaN or infinite voxels; keep: store where they are, so that they come back; zero, "
     "background or a number: replace them by 0, by the background of the grid or by that number")
    ("report", value<std::string>()->value_name("FILE"),
     "write a JSON report to FILE, whose name ends in .json; '-' is stdout")
    ("resume", bool_switch(),
     "keep the finished parts of a fit in chunks in the folder OUT.esvr.parts until OUT.esvr is "
     "written, or the finished frames of a sequence, and continue from those that are there")
    ("progress", value<std::string>()->value_name("P")->default_value("text"),
     "text: a bar on a terminal, and lines in a log with --verbose; json: lines of JSON on stderr")
    ("force,f", bool_switch(), "replace OUT.esvr and the report if they exist");
  // clang-format on
}

}  // namespace

cli::CommandLine commandLine() {
  cli::CommandLine line(programText());
  line.argument("input", "IN.vdb");
  line.volumeInputs({"input"});
  line.argument("output", "OUT.esvr");
  addGoalOptions(line.options());
  addFileOptions(line.options());
  cli::addSequenceOptions(line.options());
  cli::addSplatInput(line.options());
  addFitOptions(line.options());
  cli::addHostMemory(line);
  line.mainOptions({"preset", "effort", "size", "ratio", "psnr", "max-error", "lossless", "count",
                    "grid", "keep", "skip", "force", "report", "frames", "resume", "device",
                    "max-vram"});
  line.helpTopic("paper", paperHelp());
  return line;
}

}  // namespace esvr::vdb2esvr
