#!/usr/bin/env python3
"""Measures what files leave out because their scenes do not need it, and writes docs/economy.md.

    economy.py measure --bin BUILD --data DATA --machine TEXT   writes docs/economy/cpu.json
    economy.py measure ... --device cuda                        writes docs/economy/cuda.json
    economy.py starts ...                                       measures the start of the programs only
    economy.py page                                             writes docs/economy.md

BUILD has the programs and bench_economy (target of that name, with -DESVR_BUILD_BENCHMARKS=ON). DATA is the folder of
real volumes (docs/data.md). TEXT describes the machine on the page. --docs chooses another folder than docs. The figures
of the page are those of cpu.json; what cuda.json adds is the time of commands on a machine with a GPU.
"""
import argparse
import array
import json
import math
import os
import pathlib
import random
import statistics
import subprocess
import sys
import tempfile
import textwrap
import time

from run_program import run

RUNS = 50  # of a command whose start is timed; the median counts
NOT_MEASURED = "not measured"
FIGURES = {"bytes_with", "bytes_without", "seconds"}  # of a decision in a report
PARTS = ["rotations", "signs", "kappa", "residual", "mask", "thresholds of blocks", "layers",
         "chunk table"]
DRAFT = ["--preset", "draft"]
ELLIPSOIDS = ["--representation", "ellipsoids"]


class Tools:
    """The programs and folders of a measurement."""

    def __init__(self, arguments, folder):
        self.bin, self.data, self.folder, self.device = arguments.bin, arguments.data, folder, arguments.device

    def program(self, name):
        folders = {"vdb2esvr": "vdb2esvr", "esvr2vdb": "esvr2vdb", "esvr-render": "render", "esvr-compare": "compare",
                   "esvr-sample": "samples", "image2vdb": "python", "bench_economy": "tests/bench/economy"}
        return self.bin / folders[name] / name

    def sample(self, kind, resolution):
        path = self.folder / f"{kind}.vdb"
        run([self.program("esvr-sample"), kind, path, "--resolution", resolution, "-f", "-q"])
        return path

    def dense(self, name, side, value, threshold=None):
        """A volume of side^3 voxels whose values are value(x, y, z)."""
        raw, path = self.folder / f"{name}.raw", self.folder / f"{name}.vdb"
        values = array.array("f", (value(x, y, z) for z in range(side) for y in range(side) for x in range(side)))
        raw.write_bytes(values.tobytes())
        run([self.program("image2vdb"), raw, path, "--dims", f"{side},{side},{side}", "--type", "float32", "-f", "-q"]
            + ([] if threshold is None else ["--threshold", threshold]))
        return path


def noise(generator):
    return lambda x, y, z: generator.random()


def wave(x, y, z):
    return math.sin(x / 5) * math.cos(y / 6) * math.sin(z / 7 + 0.3)


def scenes(tools):
    """Name, what it is, and the input and the options of vdb2esvr."""
    plume = tools.sample("plume", 96)
    return [
        ("constant grid", "64^3 voxels of one value",
         tools.dense("constant", 64, lambda x, y, z: 0.5), []),
        ("constant grid as an ellipsoid", "the same, `--representation ellipsoids`",
         tools.dense("constant", 64, lambda x, y, z: 0.5), ELLIPSOIDS),
        ("single tile", "8^3 voxels of one value", tools.dense("tile", 8, lambda x, y, z: 2.0), []),
        ("level set", "esvr-sample levelset", tools.sample("levelset", 96), []),
        ("smoke", "esvr-sample plume", plume, []),
        ("smoke as ellipsoids", "the same, `--representation ellipsoids`", plume, ELLIPSOIDS),
        ("smoke, float32", "the same, `--count 1500 --storage float32`", plume,
         ["--count", "1500", "--storage", "float32", "--iterations", "200"]),
        ("smoke, fitted in chunks", "the same, `--count 1500 --chunk-voxels 20000`", plume,
         ["--count", "1500", "--chunk-voxels", "20000", "--iterations", "200"]),
        ("smoke within a bound", "the same, `--max-error 3%`", plume, ["--max-error", "3%"]),
        ("faint smoke", "smoke1.vdb, `--count 20000`", tools.data / "smoke1.vdb",
         ["--count", "20000", "--iterations", "100"]),
        ("CT scan", "aneurism.vdb, `--count 10000`", tools.data / "aneurism.vdb",
         ["--count", "10000", "--iterations", "100"]),
        ("diffuse data", "esvr-sample diffuse-scalar, `--representation ellipsoids`",
         tools.sample("diffuse-scalar", 64), ELLIPSOIDS),
        ("skeleton", "esvr-sample tree, `--representation ellipsoids`", tools.sample("tree", 96), ELLIPSOIDS + DRAFT),
        ("neuron", "neuron_rp140212.vdb, `--count 10000`", tools.data / "neuron_rp140212.vdb",
         ["--count", "10000", "--iterations", "100"]),
        ("checkerboard", "32^3 voxels of 1 and 0", tools.dense("checkerboard", 32, lambda x, y, z: (x + y + z) % 2), []),
        ("noise", "32^3 random voxels", tools.dense("noise", 32, noise(random.Random(1))), []),
        ("signed data", "a wave of 48^3 voxels, `--representation ellipsoids`", tools.dense("wave", 48, wave, -2),
         ELLIPSOIDS),
        ("several grids", "gas_0001.vdb, lossless", tools.data / "sequence/gas_0001.vdb", ["--lossless"]),
        ("integers only", "gas_0001.vdb, `-g flags`", tools.data / "sequence/gas_0001.vdb", ["-g", "flags"]),
        ("sequence", "8 frames of a fire, `-g density -g temperature`", tools.data / "fire/fluid_data_####.vdb",
         ["-g", "density", "-g", "temperature", "--frames", "41-48"])]


def decisions(report):
    """What `left_out` of the report says, of the first grid of each file."""
    grids = report.get("grids", [])
    return {entry["part"]: entry for entry in grids[0].get("left_out", [])} if grids else {}


def measure_scene(tools, scene):
    name, detail, source, options = scene
    out, report = tools.folder / "out.esvr", tools.folder / "report.json"
    start = time.perf_counter()
    run([tools.program("vdb2esvr"), source, out, "--device", tools.device, "--force", "--quiet", "--report", report]
        + options)
    seconds = time.perf_counter() - start
    figures = json.loads(run([tools.program("bench_economy"), out]))
    return {"name": name, "detail": detail, "seconds": seconds, "file_bytes": out.stat().st_size,
            "decisions": decisions(json.loads(report.read_text())), **figures}


def spheres(tools):
    out = tools.folder / "spheres.esvr"
    run([tools.program("bench_economy"), "spheres", out])
    return {"name": "spheres only", "detail": "1000 spheres of float32, not fitted", "seconds": None,
            "file_bytes": out.stat().st_size, "decisions": {}, **json.loads(run([tools.program("bench_economy"), out]))}


def loaded(words):
    """The libraries that a command loads or looks for, by the messages of the dynamic linker."""
    done = subprocess.run(words, capture_output=True, text=True, check=False, env={**os.environ, "LD_DEBUG": "files"})
    return {name: f"lib{name}" in done.stderr for name in ["cuda", "openvdb"]}


def milliseconds(words):
    times = []
    for _ in range(RUNS):
        start = time.perf_counter()
        subprocess.run(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=False)
        times.append(1e3 * (time.perf_counter() - start))
    return statistics.median(times)


def empty_program(tools, libraries):
    """A program that does nothing, linked with libraries. Its time is that of the dynamic linker."""
    path = tools.folder / ("empty" + "".join(libraries))
    source = tools.folder / "empty.cpp"
    source.write_text("int main() {}\n")
    run(["c++", source, "-o", path, "-Wl,--no-as-needed", *libraries])
    return path


def commands(tools):
    """Times the commands that need no device, on a small file of ellipsoids."""
    small = tools.folder / "small.esvr"
    run([tools.program("vdb2esvr"), tools.sample("plume", 96), small, "--device", "cpu", "--force", "--quiet"]
        + ELLIPSOIDS + DRAFT)
    words = {"esvr2vdb --list": ["esvr2vdb", "--list", small], "esvr2vdb --check": ["esvr2vdb", "--check", small],
             "esvr2vdb --list of a .vdb file": ["esvr2vdb", "--list", tools.sample("plume", 96)]}
    words.update({f"{p} --help": [p, "--help"] for p in ["esvr2vdb", "vdb2esvr", "esvr-render", "esvr-compare"]})
    full = {name: [str(tools.program(w[0])), *map(str, w[1:])] for name, w in words.items()}
    full.update({f"an empty program{text}": [str(empty_program(tools, libraries))]
                 for text, libraries in {"": [], " with libopenvdb": ["-lopenvdb"]}.items()})
    return [{"command": name, "milliseconds": milliseconds(w), **loaded(w)} for name, w in full.items()]


def starts_again(arguments):
    """Replaces the times of the commands in a file that measure() has written."""
    path = arguments.docs / "economy" / f"{arguments.device}.json"
    content = json.loads(path.read_text())
    with tempfile.TemporaryDirectory() as temporary:
        content["commands"] = commands(Tools(arguments, pathlib.Path(temporary)))
    path.write_text(json.dumps(content, indent=1) + "\n")


def measure(arguments):
    folder = arguments.docs / "economy"
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as temporary:
        tools = Tools(arguments, pathlib.Path(temporary))
        measured = [spheres(tools)]
        for scene in scenes(tools):
            print(scene[0], file=sys.stderr, flush=True)
            measured.append(measure_scene(tools, scene))
        content = {"machine": arguments.machine, "scenes": measured, "commands": commands(tools)}
    (folder / f"{arguments.device}.json").write_text(json.dumps(content, indent=1) + "\n")


def table(header, rows):
    lines = ["| " + " | ".join(header) + " |", "|---|" + "---|" * (len(header) - 1)]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows]) + "\n"


def paragraph(text):
    return textwrap.fill(text, 120) + "\n\n"


def part_of(grid, name):
    return next(p for p in grid["parts"] if p["part"] == name)


def signed(number):
    return f"{number:+d}" if number else "0"


def cell(scene, name):
    """What the grids of a scene have of a part: stored, or the bytes that forcing it in adds."""
    parts = [part_of(g, name) for g in scene["grids"]]
    if not parts:
        return "no fitted grid"
    stored = sum(p["stored"] for p in parts)
    forced = [p["forced"]["bytes_with"] - p["forced"]["bytes_without"] for p in parts if "forced" in p]
    texts = [] if not stored else ["stored" if len(parts) == 1 else f"stored in {stored} of {len(parts)}"]
    if forced:
        texts.append(f"out, {signed(sum(forced))} bytes")
    return "; ".join(texts) or "-"


def overview(measured):
    rows = [[s["name"], f"{s['file_bytes']:,}", *[cell(s, name) for name in PARTS]] for s in measured]
    return "## Parts of the files\n\n" + paragraph(
        "*Stored* means that the file has the part. *Out* means that the file does not have it, with the bytes that the file "
        "grows by if it is forced in. A dash means that the part makes no sense there; the section \"What cannot be forced\" "
        "says why. For a sequence, the parts are those of its first frame.") + table(["scene", "bytes", *PARTS], rows)


def time_rows(measured):
    for scene in measured:
        for grid in scene["grids"]:
            for part in grid["parts"]:
                if "forced" in part:
                    yield scene, grid, part["part"], part["forced"]


def times(measured):
    def row(scene, grid, part, f):
        share = 100 * (f["bytes_with"] / f["bytes_without"] - 1)
        delta = {k: 1e3 * (f[f"{k}_seconds_with"] - f[f"{k}_seconds_without"]) for k in ["encode", "decode"]}
        return [scene["name"], part, f"{f['bytes_with'] - f['bytes_without']:+,}", f"{share:+.1f} %",
                f"{delta['encode']:+.1f} ms", f"{delta['decode']:+.1f} ms"]
    return "## What forcing costs\n\n" + paragraph(
        "Bytes and time that are added to the whole file if one part is forced in. The time is that of encoding the file and "
        "of decoding the voxels of the grid, the fastest of five runs each. Such differences are within the noise of the machine "
        "where they are negative, and positive ones of the same size are too.") + table(["scene", "part", "bytes", "share of the file", "encoding", "decoding"],
                                 [row(*r) for r in time_rows(measured)])


def streams(measured):
    rows = [[s["name"], f"{g['ellipsoids']:,}", *[f"{g['streams'][k]:,}" for k in
             ["positions", "scales", "rotations", "intensities"]]]
            for s in measured for g in s["grids"] if g["streams"] and g["ellipsoids"]]
    return "## Bits for each ellipsoid\n\n" + paragraph(
        "In quantised ellipsoids, the number of bits of a parameter follows from the weight and the shape of the ellipsoid. "
        "The table has the bytes of each stream. A rotation of a sphere, and of an ellipsoid with a small weight, has few bits "
        "or none. The octave of the weight is a part of the stream of intensities. Float32 storage has no such bits.") + table(
            ["scene", "ellipsoids", "positions", "scales", "rotations", "intensities"], rows)


def figure(entry, key):
    return f"{entry[key]:,}" if key in entry else NOT_MEASURED


def decided(measured):
    def row(scene, part, entry):
        seconds = f"{entry['seconds']:.2f}" if "seconds" in entry else NOT_MEASURED
        return [scene["name"], part, "yes" if entry["used"] else "no", figure(entry, "bytes_with"),
                figure(entry, "bytes_without"), seconds]
    rows = [row(s, p, s["decisions"][p]) for s in measured for p in ["clamp", "residual", "plateau", "representation"]
            if p in s["decisions"] and FIGURES & s["decisions"][p].keys()]
    return "## Decisions of the conversion\n\n" + paragraph(
        "What the list `left_out` of the report says of the first grid ([report.md](report.md#what-the-conversion-decided)). "
        "Only decisions with a figure are listed. A single figure that was not needed is marked so.") + table(
            ["scene", "part", "used", "bytes with", "bytes without", "seconds to decide"], rows)


def sharing(measured):
    rows = [[s["name"], f"{len(s['grids'])}", f"{s['sharing']['bytes_with']:,}", f"{s['sharing']['bytes_without']:,}",
             f"{s['sharing']['bytes_without'] - s['sharing']['bytes_with']:+,}"] for s in measured if s["sharing"]]
    return "## Sharing between grids\n\n" + paragraph(
        "The same voxels, coded with references to other grids and with common sections, and without both. A file of one grid "
        "has nothing to share, and its file has no bytes for it. The first frame of a sequence counts.") + table(
            ["scene", "grids", "bytes with sharing", "without", "saved"], rows)


def reasons(measured):
    found = {(p["part"], p["why"]) for s in measured for g in s["grids"] for p in g["parts"]
             if not p["stored"] and p["why"]}
    return "## What cannot be forced\n\n" + table(["part", "why"], [list(r) for r in sorted(found)]) + "\n" + "".join([
        "- **clamp**: one byte of the grid record says whether there is one, in either case. Forcing it changes voxels.\n",
        "- **bits of an intensity**: all quantised ellipsoids have them. Other bits would be other voxels.\n",
        "- **GPU**: a device is an option of the conversion and no part of a file.\n"])


def devices(files):
    """Seconds of the conversions on each machine."""
    if "cuda" not in files:
        return ""
    of_gpu = {s["name"]: s["seconds"] for s in files["cuda"]["scenes"]}
    rows = [[s["name"], f"{s['seconds']:.2f}", f"{of_gpu[s['name']]:.2f}"]
            for s in files["cpu"]["scenes"] if s["seconds"] is not None and s["name"] in of_gpu]
    return "## Conversion with and without a GPU\n\n" + paragraph(
        "Seconds of the whole command `vdb2esvr` on the two machines, with `--device cpu` and `--device cuda`. Starting CUDA "
        "takes about 0.4 s, which small scenes and scenes without ellipsoids do not gain. By default (`--device auto`), a GPU "
        "is used where there is one.") + table(["scene", "cpu", "cuda"], rows)


def starts(files):
    rows = [[c["command"], device, f"{c['milliseconds']:.1f}", "yes" if c["openvdb"] else "no", "yes" if c["cuda"] else "no"]
            for device, content in files.items() for c in content["commands"]]
    text = table(["command", "machine", "milliseconds", "loads libopenvdb", "loads libcuda"], rows)
    if "cuda" not in files:
        text += f"\nOn a machine with a GPU: **{NOT_MEASURED}**, because `docs/economy/cuda.json` does not exist.\n"
    return "## Start of the programs, and the GPU\n\n" + paragraph(
        f"Median of {RUNS} runs, process start included. `--list` and `--check` read a small file of ellipsoids. The CUDA "
        "driver is loaded when a device is selected, and OpenVDB when a VDB file or a carried grid is read or written, and "
        "not before. An empty program that is linked with libopenvdb shows what loading it costs.") + text


INTRODUCTION = """\
# Economy

*This page is made by `tests/bench/economy.py`; do not edit it.*

What does a file leave out because its scene does not need it, and what would it cost to store it nevertheless?
`bench_economy` adds a part to a grid of a finished file in a way that keeps all voxels: rotations whose quaternions
are -1 in place of 1, a sign for each intensity, a kappa for each ellipsoid, a residual of zeros, the mask of the
decoded voxels, the same threshold for each block, two layers, a second chunk without ellipsoids. It encodes both files, decodes both, and fails if a bit
of a voxel differs. `vdb2esvr` itself has no option for this.

    python3 tests/bench/economy.py measure --bin build/release --data DATA --machine TEXT
    python3 tests/bench/economy.py page

"""


def load(docs):
    paths = {device: docs / "economy" / f"{device}.json" for device in ["cpu", "cuda"]}
    return {device: json.loads(path.read_text()) for device, path in paths.items() if path.exists()}


def page(arguments):
    files = load(arguments.docs)
    if "cpu" not in files:
        raise SystemExit("nothing was measured; run economy.py measure")
    measured = files["cpu"]["scenes"]
    machines = "".join(f"- {device}: {content['machine']}\n" for device, content in files.items())
    described = table(["scene", "what it is"], [[s["name"], s["detail"]] for s in measured])
    sections = [overview(measured), times(measured), streams(measured), decided(measured), sharing(measured),
                reasons(measured), devices(files), starts(files)]
    text = "\n".join(section for section in sections if section)
    (arguments.docs / "economy.md").write_text(INTRODUCTION + machines + "\n" + described + "\n" + text)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    jobs = {"measure": measure, "starts": starts_again, "page": page}
    parser.add_argument("what", choices=jobs)
    parser.add_argument("--bin", type=pathlib.Path, default=pathlib.Path("build/release"))
    parser.add_argument("--data", type=pathlib.Path, default=pathlib.Path("DATA"))
    parser.add_argument("--docs", type=pathlib.Path, default=pathlib.Path("docs"))
    parser.add_argument("--device", choices=["cpu", "cuda"], default="cpu")
    parser.add_argument("--machine", default="a machine that was not described")
    arguments = parser.parse_args()
    jobs[arguments.what](arguments)


if __name__ == "__main__":
    main()
