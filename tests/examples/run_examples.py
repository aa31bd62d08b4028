#!/usr/bin/env python3
"""run_examples.py "PROGRAM [COMMAND]" MAKE_GRIDS PROGRAM...: runs the examples of a program's --help.

Each example runs in a shell, in a folder of its own that has the files which the example reads
(inputs.py). A name that inputs.py does not know is an error of the program that is run. Numbers that
set the amount of work are replaced by smaller ones, pictures are small, and nothing else is changed. An
example must exit with 0, and a converter must write a file. Where ffmpeg is missing, a line says that
examples of videos were not run.
"""
import os
import pathlib
import re
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile

from inputs import FRAMES, Inputs

LIMIT_S = 120
# Options that set the amount of work, with the values that they get.
QUICK = {"--seconds": "1", "--count": "200", "--turntable": "3", "--psnr": "40", "--fps": "32",
         "--min-radius": "0.5"}
SAMPLERS = ("esvr-sample", "swc2vdb")
CONVERTERS = SAMPLERS + ("vdb2esvr", "esvr2vdb", "esvr-render")


def examples_of(program):
    """The lines of the section of examples. A backslash continues a line."""
    shown = subprocess.run(shlex.split(program) + ["--help"], capture_output=True, text=True, check=True)
    section = shown.stdout.partition("\nExamples:\n")[2]
    return [line.strip() for line in section.replace("\\\n", " ").splitlines() if line.strip()]


def quickened(words):
    """The words with less work."""
    quick = dict(QUICK)
    if words[0] in SAMPLERS:
        quick.update({"--resolution": "48", "--frames": str(FRAMES)})
    else:
        quick["--frames"] = f"1-{FRAMES}"
    added = ["--resolution", "64x64"] if words[0] == "esvr-render" else []
    if "--bench" in words:
        added += ["--turntable", quick["--turntable"]]
    return [quick.get(before, word) for before, word in zip([""] + words, words)] + added


def output_of(words):
    """The output of a converter is its second word, after the input."""
    begins_with_files = len(words) > 2 and not any(word.startswith("-") for word in words[1:3])
    return words[2] if words[0] in CONVERTERS and begins_with_files else None


def serve(words, folder):
    """A viewer serves until it is interrupted."""
    with subprocess.Popen(words, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                          text=True) as process:
        address = process.stdout.readline()
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=LIMIT_S)
    if "http://" not in address:
        return f"it printed no address, but {address}{out}{err}"
    return "" if process.returncode == 0 else f"it exited with {process.returncode}: {err}"


def run(words, folder):
    """Runs an example. Returns what is wrong, or an empty text."""
    if words[0] == "esvr-view" and "--export" not in words:
        return serve(words, folder)
    before = set(folder.rglob("*"))
    done = subprocess.run(words, cwd=folder, capture_output=True, text=True, timeout=LIMIT_S)
    if done.returncode:
        return f"it exited with {done.returncode}: {done.stdout}{done.stderr}"
    if output_of(words) and not set(folder.rglob("*")) - before:
        return "it wrote no file"
    return ""


def check(example, inputs, folder):
    words = quickened(shlex.split(example, comments=True))
    if any(word.endswith(".mp4") for word in words) and not shutil.which("ffmpeg"):
        print(f"not run, because ffmpeg is missing: {example}")
        return True
    is_sequence = any("#" in word for word in words)
    for word in words[1:]:
        for name in re.split("[=: ]", word):
            if name != output_of(words):
                inputs.provide(name, folder, is_sequence)
    try:
        wrong = run(words, folder)
    except subprocess.TimeoutExpired:
        wrong = f"it took more than {LIMIT_S} s"
    print(f"{'FAILED' if wrong else 'ok'}: {example}" + (f"\n{shlex.join(words)}: {wrong}" if wrong else ""))
    return not wrong


def main():
    program, make_grids, *paths = sys.argv[1:]
    path = [str(pathlib.Path(p).parent) for p in paths]
    with tempfile.TemporaryDirectory() as temporary:
        scratch = pathlib.Path(temporary)
        inputs = Inputs(scratch / "inputs", make_grids)
        opener = scratch / "bin/xdg-open"  # so that no browser is opened
        opener.parent.mkdir()
        opener.write_text("#!/bin/sh\n")
        opener.chmod(0o755)
        os.environ["PATH"] = os.pathsep.join([str(opener.parent)] + path + [os.environ["PATH"]])
        examples = examples_of(program)
        passed = 0
        for number, example in enumerate(examples):
            folder = scratch / str(number)
            folder.mkdir()
            passed += check(example, inputs, folder)
    if not examples:
        sys.exit(f"{program} --help has no examples")
    sys.exit(passed != len(examples))


main()
