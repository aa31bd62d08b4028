#!/usr/bin/env python3
"""Measures the speed and the errors of drawing for the section "Drawing" of docs/benchmarks.md.

    draw_benchmarks.py fit    --bin BUILD --data DIR --out OUT   makes the files that are drawn
    draw_benchmarks.py speed  --bin BUILD --data DIR --out OUT   compares speed and errors with NanoVDB
    draw_benchmarks.py parts  --bin BUILD --data DIR --out OUT   varies --depth-parts and --min-transmittance
    draw_benchmarks.py sheets --bin BUILD --data DIR --out OUT   draws ESVR, NanoVDB and their difference
    draw_benchmarks.py large  --bin BUILD --swc FILE --out OUT   draws a neuron of 50 million voxels

Run `fit` first. The other commands print the rows of their Markdown tables; `sheets` writes
OUT/drawing_*.png. --device chooses the device that fits and draws.
"""
import argparse
import json
import pathlib

from fit_benchmarks import WHOLE_ANEURISM, run

SCENES = [("aneurism", "12000"), ("aneurism", "59000"), ("smoke1", "12000"),
          ("wdas_cloud_sixteenth", "12000"), ("neuron_rp140212", "20000"), ("neuron_m207", "30000"),
          ("hydrogen_atom", "4000")]
ITERATIONS = "1500"
SHEETS = [("aneurism", "59000"), *SCENES[2:]]
METHODS = {"voxels": [], "sum": ["--between", "sum"]}
PARTS = [*(["--depth-parts", parts] for parts in ["1", "4", "8", "16"]), ["--min-transmittance", "0"]]


def box_of(name):
    return {"aneurism": WHOLE_ANEURISM, "hydrogen_atom": ["--box", "0,0,0,127,127,127"]}.get(name, [])


def esvr(arguments, name, count):
    return arguments.out / f"draw_{name}_{count}.esvr"


def label(name, count):
    return f"{name}, {int(count):,}" if name == "aneurism" else name


def fit(arguments):
    for name, count in SCENES:
        run([arguments.bin / "vdb2esvr/vdb2esvr", arguments.data / f"{name}.vdb",
             esvr(arguments, name, count), "--count", count, "--iterations", ITERATIONS, "--storage",
             "float32", "--representation", "ellipsoids", *box_of(name), "--device", arguments.device, "--force", "--quiet"])


def bench(arguments, file, *options):
    """The report of esvr-render --bench."""
    report = arguments.out / "bench.json"
    run([arguments.bin / "render/esvr-render", file, "--bench", "--device", arguments.device,
         "--report", report, "--force", "--quiet", *options])
    return json.loads(report.read_text())


def megabytes(figures):
    return f"{figures['device_bytes'] / 1e6:.1f}"


def ratio(report):
    return f"{report['drawn']['fps_median'] / report['reference']['fps_median']:.1f}"


def speed(arguments):
    for name, count in SCENES:
        file = esvr(arguments, name, count)
        reference = ["--ref", arguments.data / f"{name}.vdb"]
        voxels, summed = (bench(arguments, file, *reference, *options)
                          for options in METHODS.values())
        nano, drawn = voxels["reference"], voxels["drawn"]
        print(f"| {label(name, count)} | {nano['fps_median']:.0f} | {megabytes(nano)} | "
              f"{drawn['fps_median']:.0f} ({drawn['fps_1_percent_low']:.0f}) | {ratio(voxels)} | "
              f"{drawn['cold_fps_median']:.0f} | "
              f"{drawn['cold_fps_median'] / nano['fps_median']:.2f} | {megabytes(drawn)} | "
              f"{voxels['image']['psnr']['mean']:.1f} | {voxels['image']['ssim']['mean']:.4f} | "
              f"{summed['drawn']['fps_median']:.0f} | {ratio(summed)} | "
              f"{megabytes(summed['drawn'])} |", flush=True)


def parts(arguments):
    for name, count in SCENES:
        file = esvr(arguments, name, count)
        reports = [bench(arguments, file, "--turntable", "180", *METHODS["sum"], *options)
                   for options in PARTS]
        print(f"| {label(name, count)} | "
              + " | ".join(f"{r['drawn']['fps_median']:.0f}" for r in reports) + " |", flush=True)


def sheets(arguments):
    for name, count in SHEETS:
        for between in ["voxels", "sum"]:
            run([arguments.bin / "render/esvr-render", esvr(arguments, name, count),
                 arguments.out / "picture.png", "--resolution", "400x400", "--background", "1,1,1",
                 "--between", between, "--ref", arguments.data / f"{name}.vdb", "--sheet",
                 arguments.out / f"drawing_{name}_{between}.png", "--device", arguments.device,
                 "--force", "--quiet"])


def large(arguments):
    volume, file = arguments.out / "large.vdb", arguments.out / "large.esvr"
    run([arguments.bin / "samples/swc2vdb", arguments.swc, volume, "--resolution", "7400",
         "--min-radius", "5.4", "--force"])
    run([arguments.bin / "vdb2esvr/vdb2esvr", volume, file, "--count", "150000", "--storage",
         "float32", "--representation", "ellipsoids", "--seconds", "15", "--device",
         arguments.device, "--force"])
    for lod in ["off", "auto"]:
        report = bench(arguments, file, "--turntable", "120", "--ref", volume, "--lod", lod,
                       "--ref-supersample", "4")
        nano, drawn, image = report["reference"], report["drawn"], report["image"]
        if lod == "off":
            print(f"| NanoVDB float | {nano['fps_median']:.0f} | {nano['fps_1_percent_low']:.0f} | | "
                  f"| | {megabytes(nano)} | | |")
        print(f"| `--lod {lod}` | {drawn['fps_median']:.0f} | {drawn['fps_1_percent_low']:.0f} | "
              f"{ratio(report)} | {drawn['cold_fps_median']:.0f} | "
              f"{drawn['cold_fps_median'] / nano['fps_median']:.2f} | {megabytes(drawn)} | "
              f"{image['psnr']['mean']:.1f} | {image['ssim']['mean']:.4f} |", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    jobs = {"fit": fit, "speed": speed, "parts": parts, "sheets": sheets, "large": large}
    parser.add_argument("what", choices=jobs)
    parser.add_argument("--bin", type=pathlib.Path, default=pathlib.Path("build/release"))
    parser.add_argument("--data", type=pathlib.Path)
    parser.add_argument("--swc", type=pathlib.Path)
    parser.add_argument("--out", type=pathlib.Path, required=True)
    parser.add_argument("--device", default="cuda")
    arguments = parser.parse_args()
    if not (arguments.swc if arguments.what == "large" else arguments.data):
        parser.error(f"{arguments.what} needs --" + ("swc" if arguments.what == "large" else "data"))
    arguments.out.mkdir(parents=True, exist_ok=True)
    jobs[arguments.what](arguments)


if __name__ == "__main__":
    main()
