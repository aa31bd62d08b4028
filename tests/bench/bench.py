#!/usr/bin/env python3
"""Measures what the documents quote, and makes their pages. This is the one driver of all cases.

    bench.py list
    bench.py run CASE... --bin FOLDER --data FOLDER --out FOLDER [--device D] [--volumes NAME...] [--rival NAME=PROGRAM...]
    bench.py page calibration|stability
    bench.py record measure|page|compare ...        (record.py)

`run` writes OUT/CASE.json, the rows of each point of a case, and prints them as a Markdown table. Points that the file has
are not measured again, so that an interrupted run goes on; remove the file to begin anew. FOLDER of --bin is a build folder
or, for cases without the Python module, one that holds the programs side by side. FOLDER of --data is searched with its
subfolders. A rival is another program: SPERR, SZ3 or zfp and the path of their sperr3d, sz3 or zfp, or vdb_lod. The cases
`formats` and `resolution` give their rivals to esvr-compare (docs/compare.md, "Compressors of your own").

`page` writes the tables of a page of docs/figures, below its text, from the figures there. It needs python3-matplotlib and
python3-numpy.
"""
import argparse
import importlib
import json
import os
import pathlib
import subprocess
import sys
import time
import typing

import record

ROOT = pathlib.Path(__file__).resolve().parents[2]
# The cases, and the modules that have the functions of these names. Only what is used is imported, because some need NumPy.
CASES = {**{name: "cases" for name in ("formats", "counts", "drawing", "paper", "resolution", "chunks", "speed", "sizes",
                                       "search", "seen", "coarser", "missing")},
         "calibration": "calibration", "splats": "splats", "stability": "stability"}
PAGES = ("calibration", "stability")
# Volumes that esvr-sample makes: its options. ESVR was not tuned with those of seed 77; the last five are the paper's.
SAMPLES = {"plume_112": ["plume", "--resolution", "112", "--seed", "77"],
           "tree_208": ["tree", "--resolution", "208", "--seed", "77"],
           "blobs_88": ["blobs", "--resolution", "88", "--seed", "77"],
           "plume_256": ["plume", "--resolution", "256"],
           **{name: [name, "--resolution", "256"]
              for name in ("8area", "empty-sphere", "synth-tube", "synth-wiggle", "diffuse-scalar")}}
BOXES = {"aneurism": "0,0,0,255,255,255", "hydrogen_atom": "0,0,0,127,127,127"}  # of the scans, as in the paper
MADE = "<!-- tests/bench/bench.py makes what follows; do not edit it. -->\n"
FOLDERS = {"vdb2esvr": "vdb2esvr", "esvr2vdb": "esvr2vdb", "esvr-compare": "compare", "esvr-render": "render",
           "esvr-sample": "samples", "swc2vdb": "samples"}


class Process(typing.NamedTuple):
    code: int
    seconds: float
    user_seconds: float


def call(*words, allowed=(0,)):
    """Runs a program. Any exit code but the allowed ones ends the script with the message of the program."""
    words = [str(word) for word in words]
    begin, before = time.monotonic(), os.times().children_user
    done = subprocess.run(words, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, check=False)
    if done.returncode not in allowed:
        raise SystemExit(f"{' '.join(words)}\nexit code {done.returncode}\n{done.stderr}")
    return Process(done.returncode, time.monotonic() - begin, os.times().children_user - before)


def program_in(folder, name):
    """The path of a program in a build folder, or in a folder that holds the programs side by side."""
    for path in (folder / name, folder / FOLDERS[name] / name):
        if path.is_file():
            return path
    raise SystemExit(f"{name} is neither in {folder} nor in {folder / FOLDERS[name]}; give the folder of the programs as --bin")


def find_volume(data, name):
    found = sorted(data.rglob(f"{name}.vdb"))
    if not found:
        raise SystemExit(f"{data} has no {name}.vdb; --volumes names the volumes to measure")
    return found[0]


class Bench:
    """The programs, the volumes and the folder of files."""

    def __init__(self, arguments):
        self.bin, self.data, self.out = (p.resolve() for p in (arguments.bin, arguments.data, arguments.out))
        self.arguments, self.device = arguments, arguments.device
        self.rivals = dict(rival.split("=", 1) for rival in arguments.rival)
        self.out.mkdir(parents=True, exist_ok=True)
        sys.path.insert(0, str(self.bin / "python"))

    def run(self, program, *words, allowed=(0,)):
        return call(program_in(self.bin, program), *words, allowed=allowed)

    def report(self, program, *words, allowed=(0,)):
        """The report of a program, and its process."""
        path = self.out / "report.json"
        path.unlink(missing_ok=True)
        process = self.run(program, *words, "--report", path, "--force", "--quiet", allowed=allowed)
        return json.loads(path.read_text()), process

    def volume(self, name):
        """The path of a volume, which is made if it is a sample."""
        if name not in SAMPLES:
            return find_volume(self.data, name)
        path = self.out / f"{name}.vdb"
        if not path.exists():
            self.run("esvr-sample", SAMPLES[name][0], path, *SAMPLES[name][1:])
        return path

    def rival(self, name):
        if name not in self.rivals:
            raise SystemExit(f"this case needs --rival {name}=PROGRAM")
        return self.rivals[name]

    def chosen(self, names):
        return [name for name in names if name in (self.arguments.volumes or names)]

    def box(self, name):
        return ["--box", BOXES[name]] if name in BOXES else []

    def fit(self, name, *options, allowed=(0,)):
        """The file and the row of figures of a conversion."""
        file = self.out / f"{name}.esvr"
        report, process = self.report("vdb2esvr", self.volume(name), file, *self.box(name), *options, "--device", self.device,
                                      allowed=allowed)
        if report["error"]:
            return None, {"failure": report["error"]}
        grid = report["grids"][0]
        return file, {"bytes": report["output"]["bytes"], "ellipsoids": grid["ellipsoids"],
                      "psnr_box": grid["metrics"]["psnr_box"], "psnr_active": grid["metrics"]["psnr_active"],
                      "psnr_t50": (grid["quality"] or {}).get("psnr_t50"),
                      "max_error": grid["metrics"]["max_error"], "stored": grid["representation"]["stored"],
                      "fit_s": grid["seconds"]["optimise"], "process_s": process.seconds}


def shown(value):
    if value is None:
        return "-"
    if isinstance(value, float):
        return f"{value:.4g}" if abs(value) < 1000 else f"{value:,.0f}"
    return f"{value:,}" if isinstance(value, int) else str(value)


def table(head, lines, numbers_from=1):
    """A table in Markdown whose columns are aligned to the right from one on."""
    rule = "|" + "---|" * numbers_from + "--:|" * (len(head) - numbers_from)
    return "\n".join(["| " + " | ".join(head) + " |", rule, *("| " + " | ".join(line) + " |" for line in lines)]) + "\n"


def write_page(path, text):
    """Writes what a page has below its own text."""
    head, mark, _ = path.read_text().partition(MADE)
    if not mark:
        raise SystemExit(f"{path} does not have the line {MADE.strip()}")
    path.write_text(head + mark + "\n" + text)


def table_of(rows):
    keys = list(dict.fromkeys(key for row in rows for key in row))
    return table(keys, [[shown(row.get(key)) for key in keys] for row in rows])


def measure(bench, name, case):
    """The rows of all points of a case, which are in its file as soon as they are known."""
    path = bench.out / f"{name}.json"
    done = json.loads(path.read_text()) if path.exists() else {}
    for key, measured in case(bench):
        key = ", ".join(key)
        if key not in done:
            rows = measured()
            done[key] = rows if isinstance(rows, dict) else list(rows)
            path.write_text(json.dumps(done, indent=1) + "\n")
            print(f"{name}: {key}", file=sys.stderr, flush=True)
    return done


def case_of(name):
    return getattr(importlib.import_module(CASES[name]), name)


def run(arguments):
    bench = Bench(arguments)
    for name in arguments.cases:
        done = measure(bench, name, case_of(name))
        rows = [row for rows in done.values() if isinstance(rows, list) for row in rows]
        if rows:
            print(f"\n### {name}\n\n{table_of(rows)}")
        summary = getattr(sys.modules[case_of(name).__module__], f"{name}_summary", None)
        if rows and summary:
            print(table_of(list(summary(rows))))


def parse():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    commands.add_parser("list", help="print the cases")
    job = commands.add_parser("run", help="measure cases")
    job.add_argument("cases", nargs="+", choices=CASES)
    job.add_argument("--bin", type=pathlib.Path, required=True)
    job.add_argument("--data", type=pathlib.Path, default=pathlib.Path("."))
    job.add_argument("--out", type=pathlib.Path, required=True)
    job.add_argument("--device", default="auto")
    job.add_argument("--volumes", nargs="+", metavar="NAME", help="only these volumes")
    job.add_argument("--rival", action="append", default=[], metavar="NAME=PROGRAM")
    job.add_argument("--views", type=int, default=360, help="pictures of a turn (360)")
    job.add_argument("--epochs", type=int, default=2800, help="of the paper's method (2800)")
    job.add_argument("--machine", default="a machine that was not described", help="text for the page of stability")
    job.add_argument("--browser", default="/usr/bin/chromium", help="that draws splats")
    job = commands.add_parser("page", help="make a page from its figures")
    job.add_argument("page", choices=PAGES)
    job.add_argument("--docs", type=pathlib.Path, default=ROOT / "docs")
    record.add_commands(commands.add_parser("record", help=record.__doc__.splitlines()[0], description=record.__doc__,
                                            formatter_class=argparse.RawDescriptionHelpFormatter))
    return parser.parse_args()


def main():
    arguments = parse()
    if arguments.command == "list":
        print("\n".join(f"{name:12}{case_of(name).__doc__.splitlines()[0]}" for name in CASES))
    elif arguments.command == "run":
        run(arguments)
    elif arguments.command == "page":
        importlib.import_module(arguments.page).page(arguments.docs)
    else:
        return arguments.do(arguments)
    return 0


if __name__ == "__main__":
    sys.exit(main())
