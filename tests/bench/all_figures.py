#!/usr/bin/env python3
"""Remakes the documents whose figures scripts measure: stability, comparison, resolution and the paper's.

    all_figures.py volumes --bin BUILD --data DATA --out OUT                makes the stand-ins for the paper's volumes
    all_figures.py gpu   --bin BUILD --data DATA --out OUT --machine TEXT   measures what needs a GPU
    all_figures.py cpu   --bin BUILD --data DATA --out OUT --machine TEXT   measures the rest
    all_figures.py pages --bin BUILD --data DATA --out OUT                  writes the documents
    all_figures.py agree OLD NEW     compares the figures of two folders like docs

The first four print the commands that they run; --dry-run prints them only, and --only names documents. Between the
parts, OUT and the folder docs go from one machine to the other. A command that fails does not stop the others,
and the exit code is then 1. `pages` writes the tables of the paper's method to OUT, because their document has text
around them. DATA/swc has the skeletons of docs/data.md. --rivals is a folder with the programs sz3, sperr3d, tthresh and
instant_ngp (samples/README.md); without it, they have no rows.

`agree` compares the JSON files that stability.py and paper/measure.py keep in docs. Bytes, numbers of ellipsoids and other
figures that do not depend on time agree within 3 %, PSNR within 0.5 dB, and largest errors within a factor of 3, as the
quality tests have it for other processors. Times are not compared.
"""
import argparse
import json
import pathlib
import shlex
import subprocess
import sys

HERE = pathlib.Path(__file__).parent
PARTS = ("volumes", "gpu", "cpu", "pages")
DOCUMENTS = ["stability", "comparison", "resolution", "paper"]
SKELETONS = (754538881, 722817260, 1734350788)  # those of docs/data.md
SHARE, DB, FACTOR = 0.03, 0.5, 3.0
# Keys of errors that depend on a few voxels, and of figures that are times or say where they were measured.
ERRORS = {"max", "rms", "max_error", "share_of_bound", "cancellation", "condition", "flip"}
LEFT_OUT = {"machine", "curve", "at", "seconds", "why", "milliseconds", "failure", "note", "setting", "sharpness", "fps",
            "encode_s", "decode_s"}


def commands(arguments):
    """The document, the part and the words of each command."""
    out, data = arguments.out, ["--bin", arguments.bin, "--data", arguments.data]
    machine = ["--machine", arguments.machine]
    swc = ["--swc", *(pathlib.Path(arguments.data) / f"swc/hemibrain_{n}.swc" for n in SKELETONS),
           "--out", out / "resolution"]
    series = [*swc, "--bin", arguments.bin]
    rivals = ["--rivals", arguments.rivals] if arguments.rivals else []
    sz3 = ["--sz3", arguments.rivals / "sz3"] if arguments.rivals else []
    sperr = ["--sperr", arguments.rivals / "sperr3d"] if arguments.rivals else []
    comparison = [*data, "--out", out / "comparison"]
    unseen = out / "unseen/section.md"
    bench = ["--bin", arguments.bin, *machine]
    volumes = out / "volumes"
    paper = [*data, "--volumes", volumes, "--out", out / "paper", *machine, *rivals]
    ngp = [("paper", "gpu", ["paper/measure.py", "ngp", *paper])] if arguments.rivals else []
    return [
        ("paper", "volumes", ["paper_volumes.py", "make", *data, "--out", volumes]),
        ("paper", "volumes", ["paper_volumes.py", "statistics", *data, "--out", volumes, "--report",
                              "docs/paper/statistics.json"]),
        ("stability", "gpu", ["stability.py", "measure", *bench, "--device", "cuda"]),
        ("stability", "cpu", ["stability.py", "measure", *bench, "--device", "cpu"]),
        ("stability", "pages", ["stability.py", "page"]),
        ("comparison", "gpu", ["comparison.py", "fit", *comparison, "--device", "cuda"]),
        ("comparison", "gpu", ["comparison.py", "tables", *comparison, "--device", "cuda"]),
        ("comparison", "cpu", ["comparison.py", "rivals", *comparison]),
        ("comparison", "cpu", ["unseen.py", *data, "--out", out / "unseen", "--section", unseen, *sz3, *sperr]),
        ("comparison", "pages", ["comparison.py", "page", *comparison, "--page", "docs/comparison.md", "--unseen",
                                 unseen]),
        ("resolution", "gpu", ["resolution_series.py", "fit", *series, "--device", "cuda"]),
        ("resolution", "cpu", ["resolution_series.py", "rivals", *series, *sz3]),
        ("resolution", "pages", ["resolution_series.py", "page", *swc]),
        ("paper", "gpu", ["paper_tables.py", "run", *data, "--out", out / "paper", "--jobs", "5"]),
        ("paper", "gpu", ["paper/measure.py", "volumes", *paper]),
        ("paper", "gpu", ["paper/measure.py", "ablations", *paper]),
        *ngp,
        ("paper", "cpu", ["paper/measure.py", "compressors", *paper, "--device", "cpu"]),
        ("paper", "pages", ["paper_tables.py", "tables", "--out", out / "paper"]),
        ("paper", "pages", ["paper/page.py"]),
        ("paper", "pages", ["check_paper_page.py"]),
    ]


def output_of(arguments, name, words):
    """Where a command's text goes: the tables of documents that are written by hand go to OUT."""
    is_table = name == "paper" and words[0] == "paper_tables.py"
    return arguments.out / f"{name}.md" if is_table and arguments.what == "pages" else None


def remake(arguments):
    failed = []
    for name, part, words in commands(arguments):
        if part != arguments.what or name not in arguments.only:
            continue
        command = [sys.executable, str(HERE / words[0]), *map(str, words[1:])]
        print(shlex.join(command), flush=True)
        if arguments.dry_run:
            continue
        arguments.out.mkdir(parents=True, exist_ok=True)
        target = output_of(arguments, name, words)
        with (target.open("w") if target else open("/dev/stdout", "w")) as text:
            if subprocess.run(command, stdout=text, check=False).returncode != 0:
                failed.append(shlex.join(command))
    for command in failed:
        print(f"failed: {command}", file=sys.stderr)
    return 1 if failed else 0


def is_number(value):
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def near(key, old, new):
    if "psnr" in key:
        return abs(old - new) <= DB
    if key in ERRORS:
        return old == new or (old * new > 0 and 1 / FACTOR <= new / old <= FACTOR)
    return abs(old - new) <= SHARE * max(abs(old), abs(new))


def named(values):
    """A list of objects with names as an object, so that a new one does not shift the others."""
    keys = [v.get("name", v.get("part", v.get("command"))) if isinstance(v, dict) else None for v in values]
    unique = all(keys) and len(set(keys)) == len(keys)
    return dict(zip(keys if unique else range(len(values)), values))


def differences(old, new, key="", where=""):
    """Yields a line for each figure that does not agree."""
    if key in LEFT_OUT or key.endswith(("seconds_with", "seconds_without")):
        return
    if isinstance(old, list) and isinstance(new, list):
        old, new = named(old), named(new)
    if isinstance(old, dict) and isinstance(new, dict):
        for inner in [*old, *(k for k in new if k not in old)]:
            if inner in old and inner in new:
                name = key if isinstance(inner, int) else inner
                yield from differences(old[inner], new[inner], name, f"{where}/{inner}")
            elif inner not in LEFT_OUT:
                yield f"{where}/{inner}: only in {'the old' if inner in old else 'the new'} folder"
    elif is_number(old) and is_number(new):
        if not near(key, old, new):
            yield f"{where}: {old} and {new}"
    elif old != new:
        yield f"{where}: {old!r} and {new!r}"


def agree(arguments):
    found = 0
    for old in sorted(arguments.old.glob("*/*.json")):
        new = arguments.new / old.relative_to(arguments.old)
        if not new.exists():
            continue
        for line in differences(json.loads(old.read_text()), json.loads(new.read_text())):
            print(f"{old.relative_to(arguments.old)}: {line}")
            found += 1
    print(f"{found} figures do not agree")
    return 1 if found else 0


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    jobs = parser.add_subparsers(dest="what", required=True)
    for part in PARTS:
        job = jobs.add_parser(part)
        job.add_argument("--bin", type=pathlib.Path, default=pathlib.Path("build/release"))
        job.add_argument("--data", type=pathlib.Path, default=pathlib.Path("DATA"))
        job.add_argument("--out", type=pathlib.Path, required=True)
        job.add_argument("--machine", default="a machine that was not described")
        job.add_argument("--rivals", type=pathlib.Path)
        job.add_argument("--only", nargs="+", choices=DOCUMENTS, default=DOCUMENTS)
        job.add_argument("--dry-run", action="store_true")
    job = jobs.add_parser("agree")
    job.add_argument("old", type=pathlib.Path)
    job.add_argument("new", type=pathlib.Path)
    arguments = parser.parse_args()
    return agree(arguments) if arguments.what == "agree" else remake(arguments)


if __name__ == "__main__":
    sys.exit(main())
