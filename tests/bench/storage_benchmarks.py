#!/usr/bin/env python3
"""Measures the bytes and the errors of stored grids for the section "Storage" of docs/benchmarks.md.

    storage_benchmarks.py compact  --bin BUILD --data DIR --out OUT   quantised and float32 ellipsoids
    storage_benchmarks.py layers   --bin BUILD --data DIR --out OUT   the first importance layers
    storage_benchmarks.py targets  --bin BUILD --data DIR --out OUT   files of a given size or PSNR
    storage_benchmarks.py lossless --bin BUILD --data DIR --out OUT   voxels stored exactly
    storage_benchmarks.py decode   --bin BUILD --data DIR --out OUT   the speed of decoding voxels

Each command prints the rows of a Markdown table. Fits run on two threads of the CPU, or on --device.
"""
import argparse
import json
import pathlib
import subprocess

from fit_benchmarks import THREADS, WHOLE_ANEURISM, convert

HYDROGEN = ["--box", "0,0,0,127,127,127"]
BOXES = {"aneurism": WHOLE_ANEURISM, "hydrogen_atom": HYDROGEN}
COMPACT = [("aneurism", "12000"), ("smoke1", "4500"), ("wdas_cloud_sixteenth", "5000"),
           ("hydrogen_atom", "4000"), ("neuron_m207", "22000")]
LAYERS = [("aneurism", "12000"), ("wdas_cloud_sixteenth", "5000"), ("smoke1", "4500")]
TARGETS = [("aneurism", "--size", "13141"), ("aneurism", "--size", "50KB"),
           ("aneurism", "--psnr", "51.54"), ("aneurism", "--psnr", "70"),
           ("smoke1", "--size", "40KB"), ("smoke1", "--size", "125KB"),
           ("wdas_cloud_sixteenth", "--size", "16104"), ("wdas_cloud_sixteenth", "--size", "40KB"),
           ("wdas_cloud_sixteenth", "--size", "80KB"), ("hydrogen_atom", "--size", "18800"),
           ("neuron_m207", "--size", "40KB"), ("neuron_m207", "--size", "200KB"),
           ("dragon_with_xform", "--psnr", "48.3"), ("cube_levelset", "--psnr", "50")]
LOSSLESS = ["aneurism", "smoke1", "wdas_cloud_sixteenth", "hydrogen_atom", "neuron_m207"]
# The forms of voxels whose decoding is timed, and the volume that esvr-sample makes for it.
DECODED = [("lossless", ["--lossless"]), ("1 %", ["--max-error", "1%"])]
LARGE = ("plume", "800")
DECODINGS = "5"
STREAMS = ["positions", "scales", "rotations", "intensities"]


def fitted(arguments, name, *options, representation="ellipsoids"):
    """The report of one conversion."""
    where = ["--device", arguments.device]
    if arguments.device == "cpu":
        where += ["--threads", THREADS]
    return convert(arguments.bin, arguments.data / f"{name}.vdb", arguments.out / "storage.esvr",
                   [*options, *BOXES.get(name, [])], where, representation)


def kilobytes(report):
    return f"{report['output']['bytes'] / 1e3:.1f}"


def compact(arguments):
    for name, count in COMPACT:
        plain = fitted(arguments, name, "--count", count, "--storage", "float32")
        packed = fitted(arguments, name, "--count", count)
        grid = packed["grids"][0]
        each = [grid["compact"]["bytes"][s] / grid["ellipsoids"] for s in STREAMS]
        print(f"| {name} | `--count {count}` | {plain['grids'][0]['metrics']['psnr_box']:.2f} | "
              f"{grid['metrics']['psnr_box']:.2f} | {kilobytes(plain)} | {kilobytes(packed)} | "
              f"{sum(each):.2f} | " + " | ".join(f"{e:.2f}" for e in each) + " |", flush=True)


def layers(arguments):
    for name, count in LAYERS:
        for k, layer in enumerate(fitted(arguments, name, "--count", count)["grids"][0]["layers"]):
            print(f"| {name} | {k + 1} | {layer['ellipsoids']:,} | {layer['bytes']:,} | "
                  f"{layer['psnr_box']:.2f} |", flush=True)


def about_if_estimated(found):
    return "about " if found["estimated"] else ""


def candidate(found):
    """The bytes and the PSNR of a representation that was considered for a goal."""
    if not found:
        return "- | -"
    about = about_if_estimated(found)
    psnr = "exact" if found["psnr_box"] is None else f"{found['psnr_box']:.2f}"
    return f"{about}{found['bytes']:,} | {about}{psnr}"


def targets(arguments):
    for name, option, goal in TARGETS:
        report = fitted(arguments, name, option, goal, representation="auto")
        grid = report["grids"][0]
        choice = grid["representation"]
        psnr = grid["metrics"]["psnr_box"]
        print(f"| {name} | `{option} {goal}` | {choice['stored']} | {report['output']['bytes']:,} | "
              f"{'exact' if psnr is None else f'{psnr:.2f}'} | "
              f"{candidate(choice['ellipsoids'])} | {candidate(choice['voxels'])} | "
              f"{report['process']['seconds']:.1f} |", flush=True)


def lossless(arguments):
    for name in LOSSLESS:
        report = fitted(arguments, name, "--lossless", representation="auto")
        source = (arguments.data / f"{name}.vdb").stat().st_size
        print(f"| {name} | {source:,} | {report['output']['bytes']:,} | "
              f"{report['process']['seconds']:.1f} |", flush=True)


def large_volume(arguments):
    """A volume of tens of millions of active voxels."""
    kind, resolution = LARGE
    source = arguments.out / f"{kind}_{resolution}.vdb"
    if not source.exists():
        subprocess.run([arguments.bin / "samples/esvr-sample", kind, source, "--resolution",
                        resolution, "--quiet"], check=True)
    return source


def decode_seconds(arguments, file):
    command = [arguments.bin / "tests/bench/bench_decode", DECODINGS, file]
    return json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)


def decode_row(arguments, source, form, options):
    file = arguments.out / "decode.esvr"
    convert(arguments.bin, source, file, options, representation="voxels")
    found = decode_seconds(arguments, file)
    seconds = found["read"] + found["values"]
    print(f"| {source.stem} | {form} | {found['active'] / 1e6:.2f} | {found['voxels'] / 1e6:.2f} | "
          f"{found['read']:.3f} | {found['values']:.3f} | {found['voxels'] / seconds / 1e6:.1f} | "
          f"{found['active'] / seconds / 1e6:.1f} |", flush=True)


def decode(arguments):
    sources = [arguments.data / f"{name}.vdb" for name in LOSSLESS] + [large_volume(arguments)]
    for source in sources:
        for form, options in DECODED:
            decode_row(arguments, source, form, options)


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    jobs = {"compact": compact, "layers": layers, "targets": targets, "lossless": lossless,
            "decode": decode}
    parser.add_argument("what", choices=jobs)
    parser.add_argument("--bin", type=pathlib.Path, default=pathlib.Path("build/release"))
    parser.add_argument("--data", type=pathlib.Path, required=True)
    parser.add_argument("--out", type=pathlib.Path, required=True)
    parser.add_argument("--device", default="cpu")
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    jobs[arguments.what](arguments)


if __name__ == "__main__":
    main()
