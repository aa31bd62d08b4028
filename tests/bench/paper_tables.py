#!/usr/bin/env python3
"""Repeats the paper's ablations and compares them with the paper's figures.

    paper_tables.py run --bin BUILD --data DIR --out OUT [--device cuda] [--epochs N] ...
    paper_tables.py tables --out OUT     prints the results as Markdown
    paper_tables.py draw --out OUT       plots error against run time of both methods (matplotlib)

`run` runs `vdb2esvr --paper` in its variants on aneurism and on the paper's five synthetic volumes
(esvr-sample), and the default fit with as many ellipsoids. The paper's frames per second depend on other
hardware and another renderer; average hits, on which they depend, are measured instead. --epochs
shortens every run by the same factor; its default is the paper's own length. --jobs runs several at
once; their seconds are then not meaningful.
"""
import argparse
import concurrent.futures
import json
import pathlib

from fit_benchmarks import convert, run

SYNTHETIC = ["8area", "empty-sphere", "synth-tube", "synth-wiggle", "diffuse-scalar"]
CURVES = ["aneurism", "smoke1"]
CURVE_MAX = 150_000  # ellipsoids before pruning; smoke1 would otherwise grow to a million
# A mask of active voxels would raise the PSNR of the sum.
BY_VALUE = ["--topology", "threshold"]
PAPER_POINTS = 100_000
PAPER_EPOCHS = 2800  # the default of PaperMethod
# Ellipsoids in thousands, PSNR, average hits; before and after pruning (tables 'Primitive type').
PAPER_TYPES = {
    "aneurism": {"ellipsoid": [(93, 51.20, 20.10), (31, 50.70, 9.05)],
                 "gaussian": [(95, 44.97, 34.73), (32, 48.16, 19.96)]},
    "8area": {"ellipsoid": [(97, 41.73, 7.84), (29, 42.67, 5.68)],
              "gaussian": [(99, 45.86, 15.44), (29, 47.93, 9.97)]},
    "empty-sphere": {"ellipsoid": [(155, 46.13, 9.79), (53, 47.40, 3.53)],
                     "gaussian": [(152, 38.10, 26.47), (52, 43.91, 13.50)]},
    "synth-tube": {"ellipsoid": [(61, 71.51, 14.99), (21, 66.25, 9.29)],
                   "gaussian": [(64, 63.02, 34.69), (22, 64.66, 19.26)]},
    "synth-wiggle": {"ellipsoid": [(33, 73.46, 12.56), (11, 67.88, 7.31)],
                     "gaussian": [(34, 65.18, 24.89), (11, 65.18, 12.28)]},
    "diffuse-scalar": {"ellipsoid": [(105, 48.90, 5.71), (29, 48.18, 5.01)],
                       "gaussian": [(106, 52.28, 13.79), (31, 53.84, 8.25)]},
}
# PSNR and ellipsoids in thousands on Aneurysm (tables 'Pruning score' and 'k').
PAPER_SCORES = {"none": (44.91, 32.4), "no-fa": (49.41, 32.3), "only-fa": (50.23, 31.8),
                "full": (50.76, 32.3), "rays": (48.76, 32.0)}  # the last one: table "Pruning performance"
PAPER_K = {"5": (50.96, 33.2), "3": (48.73, 32.7), "learned": (49.76, 33.8)}


def whole(resolution):
    last = resolution - 1
    return ["--box", f"0,0,0,{last},{last},{last}"]


def sources(arguments):
    """The name, file and box of every volume. It makes the synthetic volumes."""
    found = {"aneurism": (arguments.data / "aneurism.vdb", whole(256))}
    for kind in SYNTHETIC:
        file = arguments.out / f"{kind}.vdb"
        if not file.exists():
            run([arguments.bin / "samples/esvr-sample", kind, file, "--resolution",
                 arguments.resolution])
        found[kind] = (file, whole(arguments.resolution))
    return {name: found[name] for name in arguments.volumes}


def method(arguments, **keys):
    """The options of a run by the paper's method."""
    keys = {"epochs": arguments.epochs, **keys}
    return ["--paper", ",".join(f"{k.replace('_', '-')}={v}" for k, v in keys.items()),
            *BY_VALUE]


def paper(arguments, name, **keys):
    """The options of a run that starts with the paper's 100,000 points, or with the number of ellipsoids
    that the paper's table has before pruning if that is less. Densification ends at this number, which
    the paper reaches by the threshold."""
    count = 1000 * PAPER_TYPES[name]["ellipsoid"][0][0]
    return method(arguments, points=min(PAPER_POINTS, count), max=count,
                  densify_threshold=arguments.threshold, **keys)


def variants(arguments, name):
    """The runs of a volume: their keys and options."""
    yield "ellipsoid", paper(arguments, name)
    yield "gaussian", paper(arguments, name, kernel="gaussian")
    if name not in arguments.ablate:
        return
    for score in ["no-fa", "only-fa", "contribution", "rays"]:
        yield f"score {score}", paper(arguments, name, prune_score=score)
    yield "k 3", paper(arguments, name, k=3)
    yield "k learned", paper(arguments, name, k="learned")


def measure(arguments, job):
    name, key, source, box, options = job
    threads = ["--threads", arguments.threads] if arguments.threads else []
    out = arguments.out / (f"{name} {key}".replace(" ", "_") + ".esvr")
    report = convert(arguments.bin, source, out, [*options, *box],
                     ("--device", arguments.device, *threads))
    grid = report["grids"][0]
    print(f"{name}, {key}: {grid['ellipsoids']} ellipsoids, {grid['metrics']['psnr_box']:.2f} dB, "
          f"{grid['seconds']['optimise']:.1f} s", flush=True)
    return {"volume": name, "run": key, "grid": grid, "process": report["process"]}


def all_of(arguments, jobs, rows):
    """Appends the results to the rows and saves all rows after each, since a run may be interrupted."""
    with concurrent.futures.ThreadPoolExecutor(arguments.jobs) as pool:
        for row in pool.map(lambda job: measure(arguments, job), jobs):
            rows.append(row)
            save(arguments, "paper_tables.json", {"epochs": arguments.epochs, "rows": rows,
                                                  "resolution": arguments.resolution})


def pruned(rows, name):
    """The number of ellipsoids that the run without ablations has after pruning."""
    row = next(r for r in rows if r["volume"] == name and r["run"] == "ellipsoid")
    return row["grid"]["ellipsoids"]


def second_jobs(arguments, found, rows):
    """Runs with as many ellipsoids as another run has after pruning: the default fit, a run with three
    pruning passes, and a run without pruning that starts from half as many points."""
    for name, (source, box) in found.items():
        count = pruned(rows, name)
        yield name, "default", source, box, ["--count", count, "--storage", "float32",
                                              *BY_VALUE]
        if name in arguments.ablate:
            yield (name, "score full in three passes", source, box,
                   [*paper(arguments, name, prunes=3), "--count", count])
            yield (name, "score none", source, box,
                   [*method(arguments, prunes=0, points=max(1, count // 2), densify_threshold=0),
                    "--count", count])


def measure_all(arguments):
    found = sources(arguments)
    jobs = [(name, key, source, box, options) for name, (source, box) in found.items()
            for key, options in variants(arguments, name)]
    rows = []
    all_of(arguments, jobs, rows)
    all_of(arguments, list(second_jobs(arguments, found, rows)), rows)
    print_tables(arguments)
    if arguments.curves:
        measure_curves(arguments)


def measure_curves(arguments):
    """Makes one run after the other, because their seconds are plotted."""
    rows = []
    for name in CURVES:
        box = whole(256) if name == "aneurism" else []
        source = arguments.data / f"{name}.vdb"
        rows.append(measure(arguments, (name, "curve paper", source, box,
                                        ["--paper", f"epochs={arguments.curve_epochs},"
                                                    f"max={CURVE_MAX}"])))
        count = rows[-1]["grid"]["ellipsoids"]
        rows.append(measure(arguments, (name, "curve default", source, box,
                                        ["--count", count, "--storage", "float32"])))
        save(arguments, "paper_curves.json", rows)


def save(arguments, name, content):
    (arguments.out / name).write_text(json.dumps(content))


def load(arguments, name):
    return json.loads((arguments.out / name).read_text())


def cell(ellipsoids, psnr, hits=None):
    text = f"{ellipsoids / 1000:.1f}k, {psnr:.2f}"
    return text if hits is None else text + f", {hits:.1f}"


def type_rows(rows):
    by_key = {(r["volume"], r["run"]): r["grid"] for r in rows}
    for name, theirs in PAPER_TYPES.items():
        for kind in ["ellipsoid", "gaussian"]:
            grid = by_key.get((name, kind))
            if not grid:
                continue
            before = grid["paper"]["prunes"][0]
            cells = [cell(before["before"], before["psnr_box_before"], before["hits_before"]),
                     cell(grid["ellipsoids"], grid["metrics"]["psnr_box"], grid["paper"]["hits"])]
            cells += [cell(1000 * n, psnr, hits) for n, psnr, hits in theirs[kind]]
            yield f"| {name} | {kind} | " + " | ".join(cells) + " |"
        if default := by_key.get((name, "default")):
            yield (f"| {name} | *default fit* | | "
                   + cell(default["ellipsoids"], default["metrics"]["psnr_box"]) + " | | |")


def ablation_rows(rows, prefix, theirs, first):
    """The rows of one ablation. `first` is the setting of the run without ablations."""
    for name in dict.fromkeys(r["volume"] for r in rows):
        grids = {r["run"]: r["grid"] for r in rows if r["volume"] == name}
        if not any(key.startswith(prefix) for key in grids):
            continue
        shown = {first: grids["ellipsoid"]}
        shown |= {key[len(prefix):]: g for key, g in grids.items() if key.startswith(prefix)}
        for key, grid in shown.items():
            paper_cell = ""
            if name == "aneurism" and key in theirs:
                paper_cell = cell(1000 * theirs[key][1], theirs[key][0])
            yield (f"| {name} | {key} | "
                   + cell(grid["ellipsoids"], grid["metrics"]["psnr_box"], grid["paper"]["hits"])
                   + f" | {paper_cell} |")


def print_tables(arguments):
    measured = load(arguments, "paper_tables.json")
    rows = measured["rows"]
    print(f"\n{measured['epochs']} epochs; ellipsoids, PSNR over the box in dB, average hits\n")
    print("| volume | kernel | before pruning | after pruning | paper, before | paper, after |")
    print("|---|---|---|---|---|---|")
    print("\n".join(type_rows(rows)))
    for title, prefix, theirs, first in [("pruning score", "score ", PAPER_SCORES, "full"),
                                         ("k", "k ", PAPER_K, "5")]:
        print(f"\n| volume | {title} | ours | the paper |\n|---|---|---|---|")
        print("\n".join(ablation_rows(rows, prefix, theirs, first)))


def draw(arguments):
    import matplotlib
    matplotlib.use("svg")
    from matplotlib import pyplot
    matplotlib.rcParams["svg.hashsalt"] = "esvr"  # the same bytes from the same data

    rows = load(arguments, "paper_curves.json")
    pyplot.figure(figsize=(8, 5), constrained_layout=True)
    for row in rows:
        of_paper = row["run"] == "curve paper"
        curve = [p for p in row["grid"]["curve"] if p["seconds"] > 0]
        pyplot.plot([p["seconds"] for p in curve], [p["psnr_box"] for p in curve],
                    "--" if of_paper else "-", color=f"C{CURVES.index(row['volume'])}",
                    label=f"{row['volume']}, {row['grid']['ellipsoids']} ellipsoids, "
                          + ("the paper's method" if of_paper else "default"))
    pyplot.xscale("log")
    pyplot.xlabel("seconds since the fit began")
    pyplot.ylabel("PSNR over the box, dB")
    pyplot.grid(True, which="both", alpha=0.3)
    pyplot.legend(fontsize="small")
    pyplot.savefig(arguments.out / "paper_error_time.svg", metadata={"Date": None})


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=["run", "tables", "draw"])
    parser.add_argument("--bin", type=pathlib.Path, default=pathlib.Path("build/release"))
    parser.add_argument("--data", type=pathlib.Path)
    parser.add_argument("--out", type=pathlib.Path, required=True)
    parser.add_argument("--device", default="cuda")
    parser.add_argument("--threads", type=int)
    parser.add_argument("--epochs", type=int, default=PAPER_EPOCHS)
    parser.add_argument("--resolution", type=int, default=256, help="resolution of the synthetic volumes")
    parser.add_argument("--volumes", nargs="+", default=["aneurism", *SYNTHETIC])
    parser.add_argument("--ablate", nargs="*", default=["aneurism"],
                        help="volumes of the tables 'Pruning score' and 'k'")
    parser.add_argument("--threshold", default="1e-4", help="densification threshold")
    parser.add_argument("--curves", action="store_true", help="also measure error against time")
    parser.add_argument("--curve-epochs", type=int, default=PAPER_EPOCHS)
    parser.add_argument("--jobs", type=int, default=1)
    arguments = parser.parse_args()
    if arguments.what == "run" and not arguments.data:
        parser.error("run needs --data")
    arguments.out.mkdir(parents=True, exist_ok=True)
    {"run": measure_all, "tables": print_tables, "draw": draw}[arguments.what](arguments)


if __name__ == "__main__":
    main()
