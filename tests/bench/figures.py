#!/usr/bin/env python3
"""Measures the cases whose figures the documents quote beyond the record (record.py), and draws their pictures.

    figures.py list
    figures.py run CASE... --bin FOLDER --data FOLDER --out FOLDER [--device D] [--volumes NAME...]
    figures.py draw JSON PICTURE.svg --x KEY --y KEY [--by KEY] [--log xy]

`run` writes OUT/CASE.json, a list of rows, and prints it as a Markdown table. Rows that the file has are not measured
again, so that an interrupted run goes on; remove the file to begin anew. FOLDER of --bin is a build folder or one that
holds the programs side by side, and FOLDER of --data is searched with its subfolders. --rival NAME=COMMAND adds a
compressor of arrays to the cases `formats` and `resolution` (docs/compare.md, "Compressors of your own").
`draw` plots one column of such a file over another one, with a line for each value of --by (python3-matplotlib).
"""
import argparse
import json
import math
import pathlib
import subprocess
import sys
import time

VOLUMES = ["aneurism", "smoke1", "wdas_cloud_sixteenth", "hydrogen_atom", "dragon_with_xform", "cube_levelset",
           "neuron_rp140212", "neuron_m207"]
# Volumes with which ESVR was not tuned, and the paper's synthetic ones: options of esvr-sample.
SAMPLES = {"plume_112": ["plume", "--resolution", "112", "--seed", "77"],
           "tree_208": ["tree", "--resolution", "208", "--seed", "77"],
           "blobs_88": ["blobs", "--resolution", "88", "--seed", "77"],
           **{name: [name, "--resolution", "256"]
              for name in ("8area", "empty-sphere", "synth-tube", "synth-wiggle", "diffuse-scalar")}}
BOXES = {"aneurism": "0,0,0,255,255,255", "hydrogen_atom": "0,0,0,127,127,127"}  # of the scans, as in the paper
FOLDERS = {"vdb2esvr": "vdb2esvr", "esvr2vdb": "esvr2vdb", "esvr-compare": "compare", "esvr-render": "render",
           "esvr-sample": "samples", "swc2vdb": "samples"}
PARTS = (200, 50, 25, 10, 4)  # of the bytes of the half-float Blosc VDB
SMALLEST = 600                # bytes; smaller files hold little but headers
COUNTS = {"aneurism": 12000, "smoke1": 12000, "wdas_cloud_sixteenth": 12000, "neuron_rp140212": 20000,
          "neuron_m207": 30000, "hydrogen_atom": 4000}
DRAWN = {"default": [], "post": ["--classification", "post"], "shade": ["--shade"], "sum": ["--between", "sum"],
         "sum, 1 part": ["--between", "sum", "--depth-parts", "1"],
         "sum, 16 parts": ["--between", "sum", "--depth-parts", "16"],
         "0.03 GB": ["--max-vram", "0.03"], "0.02 GB": ["--max-vram", "0.02"]}
RESOLUTIONS = (256, 512, 1024, 2048)
PAPER_EPOCHS = 2800           # the paper's own length; --epochs shortens it
PAPER_COUNTS = {"aneurism": 93_000, "8area": 97_000, "empty-sphere": 155_000, "synth-tube": 61_000,
                "synth-wiggle": 33_000, "diffuse-scalar": 105_000}  # ellipsoids before pruning in the paper's tables
PAPER_RUNS = {"ellipsoid": {}, "gaussian": {"kernel": "gaussian"}, "score no-fa": {"prune-score": "no-fa"},
              "score only-fa": {"prune-score": "only-fa"}, "k 3": {"k": "3"}, "k learned": {"k": "learned"}}


class Bench:
    """The programs, the volumes and the folder of files."""

    def __init__(self, arguments):
        self.bin, self.data, self.out = (p.resolve() for p in (arguments.bin, arguments.data, arguments.out))
        self.arguments = arguments
        self.out.mkdir(parents=True, exist_ok=True)

    def run(self, program, *words, allowed=(0,)):
        """The exit code. Any other than the allowed ones ends the script with the message of the program."""
        path = next((p for p in (self.bin / program, self.bin / FOLDERS[program] / program) if p.is_file()), None)
        if path is None:
            raise SystemExit(f"{self.bin} does not have {program}; give the folder of the programs as --bin")
        done = subprocess.run([str(path), *map(str, words)], capture_output=True, text=True, check=False)
        if done.returncode not in allowed:
            raise SystemExit(f"{program} {' '.join(map(str, words))}\n{done.stderr}")
        return done.returncode

    def report(self, program, *words, allowed=(0,)):
        path = self.out / "report.json"
        path.unlink(missing_ok=True)
        self.run(program, *words, "--report", path, "--force", "--quiet", allowed=allowed)
        return json.loads(path.read_text())

    def volume(self, name):
        """The path of a volume, which is made if it is a sample."""
        if name in SAMPLES:
            path = self.out / f"{name}.vdb"
            if not path.exists():
                self.run("esvr-sample", SAMPLES[name][0], path, *SAMPLES[name][1:])
            return path
        found = sorted(self.data.rglob(f"{name}.vdb"))
        if not found:
            raise SystemExit(f"{self.data} has no {name}.vdb; --volumes names the volumes to measure")
        return found[0]

    def chosen(self, names):
        return [name for name in names if name in (self.arguments.volumes or names)]

    def box(self, name):
        return ["--box", BOXES[name]] if name in BOXES else []

    def fit(self, name, *options, allowed=(0,)):
        """The file and the row of figures of a conversion."""
        file = self.out / f"{name}.esvr"
        begin = time.monotonic()
        report = self.report("vdb2esvr", self.volume(name), file, *self.box(name), *options, "--device",
                             self.arguments.device, allowed=allowed)
        if report["error"]:
            return None, {"failure": report["error"]}
        grid = report["grids"][0]
        return file, {"bytes": report["output"]["bytes"], "ellipsoids": grid["ellipsoids"],
                      "psnr_box": grid["metrics"]["psnr_box"], "psnr_active": grid["metrics"]["psnr_active"],
                      "psnr_t50": (grid["quality"] or {}).get("psnr_t50"),
                      "max_error": grid["metrics"]["max_error"], "stored": grid["representation"]["stored"],
                      "fit_s": grid["seconds"]["optimise"], "process_s": time.monotonic() - begin}

    def rivals(self):
        return [word for rival in self.arguments.rival for word in ("--external-command", rival)]


def formats(bench):
    """Other formats at the same bytes: half-float Blosc VDB divided by 200 to 4 (docs/figures/comparison.md)."""
    for name in bench.chosen(VOLUMES + list(SAMPLES)[:3]):
        source = [bench.volume(name), *bench.box(name)]
        whole = bench.report("esvr-compare", "table", *source, "--rows", "none", "--runs", 1)["half_blosc_bytes"]
        for part in PARTS:
            size = whole // part
            if size < SMALLEST:
                continue

            def measured(name=name, source=source, part=part, size=size):
                rows = []
                for title, measure in {"ESVR": "auto", "ESVR, --measure values": "values"}.items():
                    file, row = bench.fit(name, "--size", size, "--measure", measure, allowed=(0, 2, 3, 4))
                    rows.append({"row": title, **row})
                words = [source[0], *([file] if file else []), *source[1:], *([] if file else ["--size", size])]
                table = bench.report("esvr-compare", "table", *words, "--rows", "matched,zfp", "--max-dense", "1GB",
                                     "--runs", 1, *bench.rivals())
                keys = ("bytes", "psnr_box", "psnr_active", "psnr_t50", "max_error", "iou", "encode_s", "decode_s")
                rows += [{"row": r["name"], **{k: r[k] for k in keys if k in r}} for r in table["rows"]
                         if (r.get("bytes") or math.inf) <= 1.02 * size and r["group"] != "ESVR"]
                return [{"volume": name, "part": f"1/{part}", "size": size, **r} for r in rows]
            yield (name, f"1/{part}"), measured


def counts(bench):
    """Single fits with the numbers of ellipsoids of docs/figures/benchmarks.md, quantised and as float32."""
    for name in bench.chosen(COUNTS):
        for storage in ("compact", "float32"):
            def measured(name=name, storage=storage):
                _, row = bench.fit(name, "--count", COUNTS[name], "--storage", storage, "--representation", "ellipsoids")
                return [{"volume": name, "storage": storage, **row}]
            yield (name, storage), measured


def drawing(bench):
    """Pictures a second against NanoVDB, with ways to draw (docs/figures/benchmarks.md)."""
    for name in bench.chosen(COUNTS):
        for way, options in DRAWN.items():
            def measured(name=name, way=way, options=options):
                file, _ = bench.fit(name, "--count", COUNTS[name], "--storage", "float32", "--representation",
                                    "ellipsoids")
                report = bench.report("esvr-render", file, "--bench", "--ref", bench.volume(name), "--turntable",
                                      bench.arguments.views, "--device", bench.arguments.device, *options)
                drawn, nano, image = report["drawn"], report["reference"], report["image"]
                return [{"volume": name, "way": way, "nanovdb_fps": nano["fps_median"], "fps": drawn["fps_median"],
                         "cold_fps": drawn["cold_fps_median"], "low_fps": drawn["fps_1_percent_low"],
                         "mb": drawn["device_bytes"] / 1e6, "nanovdb_mb": nano["device_bytes"] / 1e6,
                         "psnr": image["psnr"]["mean"], "ssim": image["ssim"]["mean"]}]
            yield (name, way), measured


def paper(bench):
    """The paper's method and its ablations, and the default fit with as many ellipsoids (docs/figures/paper.md)."""
    for name in bench.chosen(PAPER_COUNTS):
        for key, changes in PAPER_RUNS.items():
            def measured(name=name, key=key, changes=changes):
                keys = {"epochs": bench.arguments.epochs, "points": min(100_000, PAPER_COUNTS[name]),
                        "max": PAPER_COUNTS[name], **changes}
                _, row = bench.fit(name, "--paper", ",".join(f"{k}={v}" for k, v in keys.items()))
                rows = [{"volume": name, "run": key, **row}]
                if key == "ellipsoid":
                    _, ours = bench.fit(name, "--count", row["ellipsoids"], "--representation",
                                        "ellipsoids")
                    rows.append({"volume": name, "run": "default fit", **ours})
                return rows
            yield (name, key), measured


def resolution(bench):
    """Bytes of skeletons at rising resolutions, ESVR and other forms (docs/figures/resolution.md)."""
    for swc in sorted(bench.data.rglob("*.swc")):
        for side in RESOLUTIONS:
            name = f"{swc.stem}-{side}"
            if name not in bench.chosen([name]):
                continue

            def measured(name=name, swc=swc, side=side):
                path = bench.out / f"{name}.vdb"
                if not path.exists():
                    bench.run("swc2vdb", swc, path, "--resolution", side)
                SAMPLES[name] = []  # the volume is in OUT
                _, row = bench.fit(name, "--preset", "draft")
                table = bench.report("esvr-compare", "table", path, "--psnr-active", row["psnr_active"], "--rows",
                                     "matched,zfp", "--max-dense", "1GB", "--runs", 1, *bench.rivals())
                rows = [{"row": "ESVR", **row}] + [{"row": r["name"], "bytes": r["bytes"], "psnr_active": r["psnr_active"]}
                                                   for r in table["rows"] if r.get("bytes")]
                return [{"skeleton": swc.stem, "resolution": side, **r} for r in rows]
            yield (name,), measured


def sequences(bench):
    """A file for each frame against one file of all frames (docs/scale.md)."""
    for folder, pattern in {"sequence": "gas_####", "fire": "fluid_data_####"}.items():
        for way, out in {"files": "frame.####.esvr", "one file": "all.esvr"}.items():
            def measured(folder=folder, pattern=pattern, way=way, out=out):
                place = bench.out / folder / way.replace(" ", "_")
                place.mkdir(parents=True, exist_ok=True)
                begin = time.monotonic()
                bench.run("vdb2esvr", bench.data / folder / f"{pattern}.vdb", place / out, "--device",
                          bench.arguments.device, "--force", "--quiet")
                seconds = time.monotonic() - begin
                check = bench.report("esvr-compare", "check", bench.data / folder / f"{pattern}.vdb", place / out)
                psnr = [g["psnr_active"] for g in check["grids"] if g["name"] == "density" and g["psnr_active"]]
                return [{"sequence": folder, "way": way, "bytes": sum(f.stat().st_size for f in place.glob("*.esvr")),
                         "least_psnr_active": min(psnr, default=None), "seconds": seconds}]
            yield (folder, way), measured


def sharing(bench):
    """Frames with many grids, with and without grids that refer to each other."""
    for name in bench.chosen(["gas_0001", "gas_0004", "fluid_data_0060", "fluid_data_0071"]):
        def measured(name=name):
            sizes = {}
            for share in ("off", "auto"):
                file = bench.out / f"{name}.esvr"
                bench.run("vdb2esvr", bench.volume(name), file, "--share", share, "--device", bench.arguments.device,
                          "--force", "--quiet")
                sizes[share] = file.stat().st_size
            return [{"frame": name, **sizes, "times": sizes["off"] / sizes["auto"]}]
        yield (name,), measured


def chunks(bench):
    """Fits in chunks against one fit of the whole volume, with a count that grows with the volume (docs/figures/scale.md)."""
    for side in (256, 512, 1024):
        for voxels in (None, 50_000, 200_000):
            def measured(side=side, voxels=voxels):
                name = f"tree_{side}"
                SAMPLES[name] = ["tree", "--resolution", side]
                _, row = bench.fit(name, "--count", 40 * side, "--representation", "ellipsoids",
                                   *(["--chunk-voxels", voxels] if voxels else []))
                return [{"volume": name, "chunk_voxels": voxels, **row}]
            yield (str(side), str(voxels)), measured


CASES = {f.__name__: f for f in (formats, counts, drawing, paper, resolution, sequences, sharing, chunks)}


def shown(value):
    if value is None:
        return "-"
    if isinstance(value, float):
        return f"{value:.4g}" if abs(value) < 1000 else f"{value:,.0f}"
    return f"{value:,}" if isinstance(value, int) else str(value)


def markdown(rows):
    keys = list(dict.fromkeys(key for row in rows for key in row))
    lines = ["| " + " | ".join(keys) + " |", "|" + "---|" * len(keys)]
    return "\n".join(lines + ["| " + " | ".join(shown(row.get(key)) for key in keys) + " |" for row in rows])


def run(arguments):
    bench = Bench(arguments)
    for case in arguments.cases:
        path = bench.out / f"{case}.json"
        done = json.loads(path.read_text()) if path.exists() else {}
        for key, measured in CASES[case](bench):
            key = ", ".join(key)
            if key not in done:
                done[key] = measured()
                path.write_text(json.dumps(done, indent=1) + "\n")
                print(f"{case}: {key}", file=sys.stderr, flush=True)
        print(f"\n### {case}\n\n{markdown([row for rows in done.values() for row in rows])}")
    return 0


def draw(arguments):
    import matplotlib  # noqa: only this command needs it
    matplotlib.use("svg")
    from matplotlib import pyplot
    rows = [row for rows in json.loads(arguments.json.read_text()).values() for row in rows]
    rows = [r for r in rows if r.get(arguments.x) is not None and r.get(arguments.y) is not None]
    figure, axes = pyplot.subplots(figsize=(7, 4.5))
    for name in dict.fromkeys(r.get(arguments.by) for r in rows):
        line = sorted((r[arguments.x], r[arguments.y]) for r in rows if r.get(arguments.by) == name)
        axes.plot(*zip(*line), marker="o", label=str(name))
    axes.set(xlabel=arguments.x, ylabel=arguments.y, xscale="log" if "x" in arguments.log else "linear",
             yscale="log" if "y" in arguments.log else "linear")
    axes.grid(alpha=0.3)
    if arguments.by:
        axes.legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(arguments.picture, metadata={"Date": None})
    return 0


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    commands.add_parser("list", help="print the cases")
    job = commands.add_parser("run", help="measure cases")
    job.add_argument("cases", nargs="+", choices=CASES)
    job.add_argument("--bin", type=pathlib.Path, required=True)
    job.add_argument("--data", type=pathlib.Path, required=True)
    job.add_argument("--out", type=pathlib.Path, required=True)
    job.add_argument("--device", default="auto")
    job.add_argument("--volumes", nargs="+", metavar="NAME", help="only these volumes")
    job.add_argument("--rival", action="append", default=[], metavar="NAME=COMMAND")
    job.add_argument("--views", type=int, default=360, help="pictures of a turn (360)")
    job.add_argument("--epochs", type=int, default=PAPER_EPOCHS, help="of the paper's method (2800)")
    job = commands.add_parser("draw", help="plot rows")
    job.add_argument("json", type=pathlib.Path)
    job.add_argument("picture", type=pathlib.Path)
    job.add_argument("--x", required=True)
    job.add_argument("--y", required=True)
    job.add_argument("--by")
    job.add_argument("--log", default="", choices=["", "x", "y", "xy"])
    arguments = parser.parse_args()
    if arguments.command == "list":
        print("\n".join(f"{name:12}{case.__doc__}" for name, case in CASES.items()))
        return 0
    return run(arguments) if arguments.command == "run" else draw(arguments)


if __name__ == "__main__":
    sys.exit(main())
