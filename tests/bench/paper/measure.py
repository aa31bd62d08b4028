#!/usr/bin/env python3
"""Measures our figures of the paper's tables, on stand-ins for the volumes that cannot be had.

    measure.py volumes   --bin BUILD --data DATA --volumes VOLUMES --out OUT --machine TEXT --rivals FOLDER
    measure.py compressors | ngp | ablations ...

VOLUMES has the stand-ins that paper_volumes.py makes. FOLDER has programs of other systems, named sz3, tthresh,
sperr3d and instant_ngp. `volumes` measures our files, the paper's method, and OpenVDB, NanoVDB and ZFP.
`compressors` measures SZ3, SPERR and TTHRESH, and `ngp` Instant-NGP at multiples of the bytes of our files. `ablations`
repeats the paper's ablations on two volumes.
Each writes a JSON file to docs/paper, which page.py reads. OUT keeps all files and reports; nothing that it holds is
made again.

Fits and then pictures are made one after the other. The searches of `volumes` for other files run beside the pictures,
on --jobs processes, so that the times of their rows are those of a busy machine.
"""
import argparse
import concurrent.futures
import functools
import json
import pathlib
import re
import shlex
import sys
import time

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
from run_program import run  # noqa: E402

ROOT = HERE.parents[2]
PART = 50                    # our file takes the bytes of the half-float Blosc VDB divided by this, as comparison.md
BOXES = {"aneurysm": "0,0,0,255,255,255"}
NGP_SIZES = (1, 4, 16, 64)   # sizes of Instant-NGP's files, relative to ours
MOST_FOR_TTHRESH = 17_000_000  # voxels of the box; a search takes TTHRESH 24 runs
EPOCHS = 280                 # of the paper's method in this comparison, a tenth of the paper's
PAPER_POINTS = 100_000
KEPT_SHARE = 0.34            # of the paper's ellipsoids, after one pruning pass
LOOKS = ("viridis:linear", "turbo:tent", "grayscale:step")
VIEWS = ["--images", "4", "--image-size", "400"]
DEPTH_PARTS = (1, 2, 4, 8, 16)
ABLATED = {"aneurysm": 93_000, "breast": 187_000}  # ellipsoids before pruning in the paper's tables
SHARPNESS = (5, 50, 500, 5000)


def kept(path, make):
    """The content of a JSON file, which `make` writes if it does not exist. A report of an interrupted program is made
    again."""
    content = json.loads(path.read_text()) if path.exists() else {"interrupted": True}
    if content.get("interrupted"):
        path.parent.mkdir(parents=True, exist_ok=True)
        make(path)
        content = json.loads(path.read_text())
    return content


def timed(words):
    start = time.perf_counter()
    run(words)
    return time.perf_counter() - start


class Subject:
    """A volume and its files in a folder of OUT."""

    def __init__(self, options, name):
        self.options, self.name = options, name
        folder = options.data if (options.data / f"{name}.vdb").exists() else options.volumes
        self.path = folder / f"{name}.vdb"
        self.out = options.out / name
        self.out.mkdir(parents=True, exist_ok=True)
        self.box = ["--box", BOXES[name]] if name in BOXES else []

    def program(self, folder, name):
        return self.options.bin / folder / name

    def table(self, name, words):
        """The report of esvr-compare table for some rows."""
        command = [self.program("compare", "esvr-compare"), "table", self.path, *words, *self.box, "--runs", "1",
                   "--device", self.options.device, "-q", "-f"]
        return kept(self.out / f"{name}.json", lambda path: run([*command, "--report", path]))

    @functools.cached_property
    def facts(self):
        return self.table("facts", ["--rows", "none"])

    @property
    def sides(self):
        box = self.facts["box"]
        return [high - low + 1 for low, high in zip(box[:3], box[3:])]

    @property
    def voxels(self):
        x, y, z = self.sides
        return x * y * z

    def convert(self, name, words):
        """The file and the report of a conversion."""
        file = self.out / f"{name}.esvr"
        command = [self.program("vdb2esvr", "vdb2esvr"), self.path, file, *self.box, "--device", self.options.device,
                   "-q", "-f", *words]
        return file, kept(self.out / f"{name}.report.json", lambda path: run([*command, "--report", path]))

    @functools.cached_property
    def ours(self):
        return self.convert("ours", ["--size", self.facts["half_blosc_bytes"] // PART])

    def by_paper(self, name, kept_count, **keys):
        """A fit by the paper's method that keeps this number of ellipsoids."""
        keys = ",".join(f"{key.replace('_', '-')}={value}" for key, value in keys.items())
        return self.convert(name, ["--paper", keys, "--count", kept_count, "--topology", "threshold"])


# Compressors of arrays

def commands(subject):
    """The options of esvr-compare that add the rows of compressors whose programs are there."""
    words = []
    for name, program in (("SZ3", "sz3"), ("SPERR", "sperr3d"), ("TTHRESH", "tthresh")):
        path = subject.options.rivals / program
        if path.exists() and (name != "TTHRESH" or subject.voxels <= MOST_FOR_TTHRESH):
            script = ROOT / "samples/compressors" / program.replace("sperr3d", "sperr")
            words += ["--external-command", f"{name}={script} {path}"]
    return words


def psnr_of(volume):
    """Our PSNR over the box."""
    return next(row["psnr_box"] for row in volume["rows"] if row["group"] == "ESVR")


def compress(options, name):
    subject, ours = Subject(options, name), results(options, "volumes")[name]
    table = subject.table("compressors", ["--rows", "none", "--size", ours["bytes"], "--psnr", psnr_of(ours), *VIEWS,
                                          *commands(subject)])
    print(name, len(table["rows"]), "rows", flush=True)
    return {"rows": rows_of(table["rows"])}


def measure_compressors(options):
    return {name: compress(options, name) for name in options.only}


# Instant-NGP

def raw_of(subject):
    """The voxels of the box as float32. esvr-compare gives them to a command, which keeps them."""
    raw = subject.out / "box.raw"
    if not raw.exists():
        take = f"sh -c {shlex.quote(f'cp $1 {shlex.quote(str(raw))}; exit 1')}"
        subject.table("raw", ["--rows", "none", "--size", "1KB", "--external-command", f"copy={take}"])
    return raw


def instant_ngp(subject, bytes_wanted, factor):
    """Encodes and decodes the box. Returns the option of esvr-compare that adds the row."""
    program = subject.options.rivals / "instant_ngp"
    packed, raw = subject.out / f"ngp-{factor}.bin", subject.out / f"ngp-{factor}.raw"

    def measure(path):
        encode = timed([program, "encode", raw_of(subject), packed, *subject.sides, factor * bytes_wanted])
        decode = timed([program, "decode", packed, raw, *subject.sides])
        path.write_text(json.dumps({"bytes": packed.stat().st_size, "encode": encode, "decode": decode}))
    made = kept(subject.out / f"ngp-{factor}.made.json", measure)
    sides = "x".join(map(str, subject.sides))
    return ["--external", f"Instant-NGP x {factor}={raw}:{made['bytes']}:{sides}:float32"
                          f":encode={made['encode']:.3f}:decode={made['decode']:.3f}"]


def ngp_rows(subject, bytes_wanted):
    """The rows of Instant-NGP: all sizes in the first look, and the size of our file in the others."""
    words = {}
    for factor in NGP_SIZES:
        try:
            words[factor] = instant_ngp(subject, bytes_wanted, factor)
        except SystemExit as failure:
            print(f"{subject.name}, Instant-NGP x {factor}: {failure}", flush=True)
    looks = {}
    for look in LOOKS:
        shown = words if look == LOOKS[0] else {f: w for f, w in words.items() if f == 1}
        flat = [word for option in shown.values() for word in option]
        table = subject.table(f"ngp-{look.replace(':', '-')}", [*flat, "--rows", "none", *VIEWS, "--colors", look])
        looks[look] = rows_of(table["rows"])
    return {"looks": looks}


def measure_ngp(options):
    bytes_of = {name: v["bytes"] for name, v in results(options, "volumes").items()}
    return {name: ngp_rows(Subject(options, name), bytes_of[name]) for name in options.only}


# One volume

def rivals(subject):
    """All other rows at our size and at our PSNR, with pictures."""
    try:
        return subject.table("rivals", [subject.ours[0], "--rows", "lossless,matched,zfp", *VIEWS])
    except SystemExit as failure:  # which would end a thread only
        raise RuntimeError(failure) from failure


def count_for_paper(subject):
    """The ellipsoids that the paper's method keeps: as many as our file has, or as would fit into its bytes."""
    report = subject.ours[1]
    return report["grids"][0]["ellipsoids"] or max(report["output"]["bytes"] // 10, 100)


def paper_fits(subject):
    """Files by the paper's method, pruned, and without pruning but with as many ellipsoids."""
    count = count_for_paper(subject)
    before = int(count / KEPT_SHARE)
    pruned = subject.by_paper("pruned", count, epochs=EPOCHS, points=min(PAPER_POINTS, before), max=before)
    unpruned = subject.by_paper("unpruned", count, epochs=EPOCHS, prunes=0, points=max(1, count // 2), max=count)
    return {"pruned": pruned, "unpruned": unpruned}


def pictures(subject):
    """The files under several transfer functions. Nothing else runs, so that speeds can be compared."""
    files = [subject.ours[0], *(file for file, _ in paper_fits(subject).values())]
    return {look: subject.table(f"look-{look.replace(':', '-')}",
                                [*files, "--rows", "none", *VIEWS, "--colors", look])["rows"] for look in LOOKS}


def bench(subject, name, file, *words):
    command = [subject.program("render", "esvr-render"), file, "--bench", "--turntable", "90", "-q", "-f",
               "--device", subject.options.device, *words]
    return kept(subject.out / f"{name}.json", lambda path: run([*command, "--report", path]))


def speeds(subject):
    """Pictures per second and memory: ours and NanoVDB, and the sum of ellipsoids by parts of the depth."""
    measured = {"whole": bench(subject, "bench", subject.ours[0], "--ref", subject.path)}
    if subject.ours[1]["grids"][0]["ellipsoids"]:
        for parts in DEPTH_PARTS:
            measured[str(parts)] = bench(subject, f"bench-{parts}", subject.ours[0], "--between", "sum",
                                         "--depth-parts", str(parts))
    return measured


def measure_volume(options, name, pool):
    """Starts all measurements of a volume. Returns the one that goes on beside others."""
    subject = Subject(options, name)
    later = pool.submit(rivals, subject)
    return subject, {"looks": pictures(subject), "speeds": speeds(subject)}, later


ROW = ("name", "group", "bytes", "psnr_box", "psnr_active", "ssim", "image_psnr", "image_ssim", "flip", "fps", "encode_s",
       "decode_s", "device_bytes", "note", "setting")


def rows_of(rows):
    """Rows with the figures that the page shows."""
    return [{key: row[key] for key in ROW if key in row} for row in rows]


def speed_of(report):
    """The figures of a report of esvr-render --bench that the page shows."""
    found = {}
    for part in ("drawn", "cold", "reference"):
        if figures := report.get(part):
            found[part] = {"fps": figures["fps_median"], "bytes": figures.get("device_bytes")}
    return found


def result(subject, now, later):
    report = subject.ours[1]
    fits = {name: {"ellipsoids": r["grids"][0]["ellipsoids"], "bytes": r["output"]["bytes"],
                   "seconds": r["seconds"]["total"]} for name, (_, r) in paper_fits(subject).items()}
    return {"sides": subject.sides, "half_blosc_bytes": subject.facts["half_blosc_bytes"],
            "active_voxels": subject.facts["active_voxels"], "bytes": report["output"]["bytes"],
            "ellipsoids": report["grids"][0]["ellipsoids"], "seconds": report["seconds"]["total"], "paper": fits,
            "rows": rows_of(later.result()["rows"]),
            "looks": {look: rows_of(rows) for look, rows in now["looks"].items()},
            "speeds": {name: speed_of(speed) for name, speed in now["speeds"].items()}}


def measure_volumes(options):
    for subject in [Subject(options, name) for name in options.only]:
        print(f"{subject.name}: {subject.ours[1]['output']['bytes']} bytes", flush=True)
        paper_fits(subject)  # kept; nothing else runs, so that times of fits can be compared
    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        started = [measure_volume(options, name, pool) for name in options.only]
        return {subject.name: result(subject, now, later) for subject, now, later in started}


# Ablations

def variants(count):
    """The runs of the paper's ablations on a volume."""
    start = {"points": min(PAPER_POINTS, count), "max": count}
    yield "ellipsoid", start
    yield "gaussian", {**start, "kernel": "gaussian"}
    for score in ("no-fa", "only-fa", "rays"):
        yield f"score {score}", {**start, "prune_score": score}
    yield "score none", {"prunes": 0, "points": int(KEPT_SHARE * count / 2), "max": int(KEPT_SHARE * count)}
    for k in (3, "learned"):
        yield f"k {k}", {**start, "k": k}


def ablation(options, name, count):
    """The rows of the ablations of a volume."""
    subject = Subject(options, name)
    files = {key: subject.by_paper(key.replace(" ", "-"), int(KEPT_SHARE * count), epochs=options.epochs, **keys)
             for key, keys in variants(count)}
    table = subject.table("ablations", [*(file for file, _ in files.values()), "--rows", "none", *VIEWS])
    by_name = {row["name"]: row for row in rows_of(table["rows"])}
    return {key: {**by_name[file.name], "ellipsoids": report["grids"][0]["ellipsoids"],
                  "hits": (report["grids"][0]["paper"] or {}).get("hits")} for key, (file, report) in files.items()}


def convergence(options, name, count):
    """PSNR over the box against seconds for several sharpnesses."""
    subject, curves = Subject(options, name), {}
    points = int(KEPT_SHARE * count)
    for k in SHARPNESS:
        _, report = subject.by_paper(f"sharpness-{k}", points, epochs=EPOCHS, prunes=0, points=points, max=points, k=k)
        curves[k] = [{"seconds": p["seconds"], "psnr_box": p["psnr_box"]} for p in report["grids"][0]["curve"]]
    return curves


def measure_ablations(options):
    return {name: {"rows": ablation(options, name, count), "sharpness": convergence(options, name, count)}
            for name, count in ABLATED.items()}


def file_of(options, what):
    return options.docs / f"paper/{what}.json"


def written(machine, volumes):
    """The text of a file of results, with one row in a line."""
    content = json.dumps({"machine": machine, "volumes": volumes}, indent=1)
    return re.sub(r"\{[^{}]*\}", lambda row: re.sub(r"\s+", " ", row.group()), content) + "\n"


def results(options, what):
    """The results that were written before, by volume."""
    return json.loads(file_of(options, what).read_text())["volumes"]


MEASURE = {"volumes": measure_volumes, "compressors": measure_compressors, "ngp": measure_ngp,
           "ablations": measure_ablations}
VOLUMES = ("aneurysm", "breast", "neuron", "bigbrain", "woodbranch", "vdeltaa", "lln2p", "beechnut",
           "pigheart")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=MEASURE)
    for folder in ("bin", "data", "volumes", "out"):
        parser.add_argument(f"--{folder}", type=pathlib.Path, required=True)
    parser.add_argument("--rivals", type=pathlib.Path, default=pathlib.Path("rivals"))
    parser.add_argument("--docs", type=pathlib.Path, default=ROOT / "docs")
    parser.add_argument("--machine", required=True)
    parser.add_argument("--device", default="cuda")
    parser.add_argument("--epochs", type=int, default=2800, help="of the ablations")
    parser.add_argument("--jobs", type=int, default=4)
    parser.add_argument("--only", nargs="+", choices=VOLUMES, default=VOLUMES)
    options = parser.parse_args()
    measured = MEASURE[options.what](options)
    path = file_of(options, options.what)
    path.parent.mkdir(parents=True, exist_ok=True)
    before = results(options, options.what) if path.exists() else {}
    path.write_text(written(options.machine, {**before, **measured}))


if __name__ == "__main__":
    main()
