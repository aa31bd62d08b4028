#!/usr/bin/env python3
"""Measures the times and the errors of conversions for docs/benchmarks.md.

    fit_benchmarks.py figures --bin BUILD --data DIR --out OUT   converts volumes of DIR on the CPU
    fit_benchmarks.py gpu --bin BUILD --data DIR --out OUT       converts them on a GPU, by phase
    fit_benchmarks.py scaling --bin BUILD --out OUT              seconds per iteration at eight resolutions
    fit_benchmarks.py draw --out OUT                             draws the figures of these results

BUILD is a build folder (build/release). Results are JSON in OUT; `draw` needs matplotlib and writes
OUT/error_time.svg and OUT/scaling.svg. Every run is a whole process; runs on the CPU have two
threads.
"""
import argparse
import json
import os
import pathlib
import subprocess
import time

THREADS = 2
# File, options and goal of each conversion.
FIGURES = [
    ("aneurism", ["--count", "12000", "--box", "0,0,0,255,255,255"], ">= 51.5 dB in 60 s"),
    ("aneurism", ["--count", "59000", "--box", "0,0,0,255,255,255"], ">= 62 dB in 120 s"),
    ("smoke1", ["--count", "12000"], ">= 51 dB in 120 s"),
    ("hydrogen_atom", ["--count", "4000", "--box", "0,0,0,127,127,127"], ">= 60 dB in 120 s"),
    ("neuron_m207", ["--count", "30000"], "under 1 GB"),
    ("neuron_rp140212", ["--count", "20000"], ""),
    ("wdas_cloud_sixteenth", ["--count", "12000"], ""),
    ("dragon_with_xform", ["--count", "8000"], ""),
]
WHOLE_ANEURISM = ["--box", "0,0,0,255,255,255"]
GPU_FIGURES = [
    ("aneurism", ["--psnr", "51.54", *WHOLE_ANEURISM], "under 1.5 s"),
    ("aneurism", ["--count", "59000", *WHOLE_ANEURISM], ">= 85 dB, optimisation under 1 s"),
    ("aneurism", ["--count", "31000", *WHOLE_ANEURISM], ">= 80 dB, under 1 s"),
    ("aneurism", ["--count", "12000", *WHOLE_ANEURISM], ">= 54 dB, under 1 s"),
    ("smoke1", ["--count", "12000"], ">= 54 dB, under 2 s"),
    ("wdas_cloud_sixteenth", ["--count", "12000"], ">= 35 dB, under 2 s"),
    ("hydrogen_atom", ["--count", "4000", "--box", "0,0,0,127,127,127"], ">= 65 dB, under 2 s"),
    ("neuron_m207", ["--count", "30000"], ">= 60 dB, under 2 s"),
    ("neuron_rp140212", ["--count", "20000"], ""),
    ("dragon_with_xform", ["--count", "8000"], ""),
    ("cube_levelset", ["--count", "12000"], ""),
]
GPU_STORAGES = ["float32", "compact"]
TREE_RESOLUTIONS = [64, 96, 128, 192, 256, 384, 512, 768]
VOXELS_PER_ELLIPSOID = 35  # as the standard preset has it
SCALING_ITERATIONS = 100


def run(command):
    """Runs a command. Returns its wall seconds and its peak memory in bytes."""
    start = time.perf_counter()
    child = subprocess.Popen([str(c) for c in command], stdout=subprocess.PIPE, text=True)
    child.stdout.read()
    _, status, usage = os.wait4(child.pid, 0)
    seconds = time.perf_counter() - start
    if os.waitstatus_to_exitcode(status):
        raise SystemExit("failed: " + " ".join(map(str, command)))
    return seconds, usage.ru_maxrss * 1024


def convert(programs, source, out, options, where=("--device", "cpu", "--threads", THREADS),
            representation="ellipsoids"):
    """Converts a file. Returns the report, with the seconds and the memory of the whole process."""
    report = out.with_suffix(".json")
    command = [programs / "vdb2esvr/vdb2esvr", source, out, *where, "--quiet", "--force",
               "--report", report, "--representation", representation, *options]
    seconds, memory = run(command)
    result = json.loads(report.read_text())
    result["process"] = {"seconds": seconds, "peak_bytes": memory}
    return result


def figures(arguments):
    rows = []
    for name, options, asked in FIGURES:
        source = arguments.data / f"{name}.vdb"
        esvr = arguments.out / f"{name}_{options[1]}.esvr"
        report = convert(arguments.bin, source, esvr, options)
        back_seconds, _ = run([arguments.bin / "esvr2vdb/esvr2vdb", esvr, esvr.with_suffix(".vdb"),
                               "--threads", THREADS, "--force"])
        grid = report["grids"][0]
        rows.append({"file": name, "options": options, "asked": asked, "grid": grid,
                     "process": report["process"], "bytes_in": report["input"]["bytes"],
                     "bytes_out": report["output"]["bytes"], "back_seconds": back_seconds})
        print(markdown_row(rows[-1]), flush=True)
    (arguments.out / "figures.json").write_text(json.dumps(rows, indent=1))


def markdown_row(row):
    metrics = row["grid"]["metrics"]
    process = row["process"]
    return (f"| {row['file']} | `{' '.join(row['options'][:2])}` | {metrics['psnr_box']:.2f} | "
            f"{metrics['psnr_active']:.2f} | {row['grid']['kernel']['kappa']:g} | "
            f"{process['seconds']:.1f} | {process['peak_bytes'] / 1e6:.0f} | "
            f"{row['bytes_out'] / 1e3:.0f} | {row['back_seconds']:.2f} | {row['asked']} |")


def gpu(arguments):
    rows = []
    for storage in GPU_STORAGES:
        for name, options, asked in GPU_FIGURES:
            esvr = arguments.out / f"{name}_{options[1]}_{storage}.esvr"
            report = convert(arguments.bin, arguments.data / f"{name}.vdb", esvr,
                             [*options, "--storage", storage], ("--device", "cuda"))
            rows.append({"file": name, "options": options, "asked": asked, "storage": storage,
                         "grid": report["grids"][0], "process": report["process"],
                         "bytes_out": report["output"]["bytes"]})
            print(gpu_row(rows[-1]), flush=True)
    (arguments.out / "gpu.json").write_text(json.dumps(rows, indent=1))


def gpu_row(row):
    grid = row["grid"]
    seconds = grid["seconds"]
    return (f"| {row['file']} | `{' '.join(row['options'][:2])}` | {row['storage']} | "
            f"{grid['ellipsoids']} | {grid['metrics']['psnr_box']:.2f} | "
            f"{grid['kernel']['kappa']:.2f} | "
            f"{seconds['optimise'] + seconds['seed']:.2f} | {seconds['encode']:.2f} | "
            f"{row['process']['seconds']:.2f} | {grid['fit']['device_bytes'] / 1e6:.0f} | "
            f"{row['bytes_out'] / 1e3:.0f} | {row['asked']} |")


def scaling(arguments):
    rows = []
    for resolution in TREE_RESOLUTIONS:
        source = arguments.out / f"tree_{resolution}.vdb"
        run([arguments.bin / "samples/esvr-sample", "tree", source, "--resolution", resolution,
             "--force"])
        tree = source_of(arguments.bin, source)
        count = max(1, tree["active_voxels"] // VOXELS_PER_ELLIPSOID)
        report = convert(arguments.bin, source, source.with_suffix(".esvr"),
                         ["--count", count, "--iterations", SCALING_ITERATIONS])
        seconds = report["seconds"]["optimise"] / SCALING_ITERATIONS
        rows.append({"resolution": resolution, "leaves": tree["bricks"],
                     "voxels": tree["active_voxels"], "seconds_per_iteration": seconds,
                     "peak_bytes": report["process"]["peak_bytes"]})
        print(rows[-1], flush=True)
    (arguments.out / "scaling.json").write_text(json.dumps(rows, indent=1))


def source_of(programs, source):
    """The properties of a grid, from the report of a fit of one ellipsoid."""
    report = convert(programs, source, source.with_suffix(".esvr"),
                     ["--count", 1, "--iterations", 1])
    return report["grids"][0]["source"]


def draw(arguments):
    import matplotlib
    matplotlib.use("svg")
    from matplotlib import pyplot
    matplotlib.rcParams["svg.hashsalt"] = "esvr"  # the same bytes from the same data

    draw_curves(pyplot, json.loads((arguments.out / "figures.json").read_text()))
    pyplot.savefig(arguments.out / "error_time.svg", metadata={"Date": None})
    draw_scaling(pyplot, json.loads((arguments.out / "scaling.json").read_text()))
    pyplot.savefig(arguments.out / "scaling.svg", metadata={"Date": None})


def draw_curves(pyplot, rows):
    pyplot.figure(figsize=(8, 5), constrained_layout=True)
    for row in rows:
        curve = [p for p in row["grid"]["curve"] if p["seconds"] > 0]
        pyplot.plot([p["seconds"] for p in curve], [p["psnr_box"] for p in curve],
                    label=f"{row['file']} {row['options'][1]}")
    pyplot.xscale("log")
    pyplot.xlabel("seconds since the fit began (2 cores)")
    pyplot.ylabel("PSNR over the box, dB")
    pyplot.grid(True, which="both", alpha=0.3)
    pyplot.legend(fontsize="small")


def draw_scaling(pyplot, rows):
    _, panels = pyplot.subplots(1, 2, figsize=(9, 4), constrained_layout=True, sharey=True)
    milliseconds = [1e3 * r["seconds_per_iteration"] for r in rows]
    for panel, key, label in zip(panels, ["voxels", "leaves"], ["active voxels", "leaves"]):
        counts = [r[key] for r in rows]
        slope = sum(x * y for x, y in zip(counts, milliseconds)) / sum(x * x for x in counts)
        panel.plot(counts, milliseconds, "o", label="trees of eight sizes")
        panel.plot(counts, [slope * x for x in counts], "-", alpha=0.5,
                   label=f"{1e6 * slope:.3g} ns each")
        panel.set_xlabel(label)
        panel.grid(True, alpha=0.3)
        panel.legend()
    panels[0].set_ylabel("milliseconds an iteration (2 cores)")


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=["figures", "gpu", "scaling", "draw"])
    parser.add_argument("--bin", type=pathlib.Path, default=pathlib.Path("build/release"))
    parser.add_argument("--data", type=pathlib.Path)
    parser.add_argument("--out", type=pathlib.Path, required=True)
    arguments = parser.parse_args()
    if arguments.what in ("figures", "gpu") and not arguments.data:
        parser.error(f"{arguments.what} needs --data")
    arguments.out.mkdir(parents=True, exist_ok=True)
    {"figures": figures, "gpu": gpu, "scaling": scaling,
     "draw": draw}[arguments.what](arguments)


if __name__ == "__main__":
    main()
