#!/usr/bin/env python3
"""Measures how long Python takes to read and decode a file, against esvr2vdb:

    PYTHONPATH=BUILD/python python3 tests/bench/python_read.py BUILD FILE.esvr [REPEATS]

They take turns. Python has imported the module before; "new Python" is a new process that imports it, too. esvr2vdb is
a new process each time, and writes a .vdb file into a temporary folder. Prints the medians and their quotients.
"""
import os
import statistics
import subprocess
import sys
import tempfile
import time

import esvr

DEFAULT_REPEATS = 5
NEW_PYTHON = "import esvr, sys; esvr.read(sys.argv[1]).grids[0].to_volume().to_numpy()"


def seconds_of(function):
    start = time.perf_counter()
    function()
    return time.perf_counter() - start


def main():
    build, path = sys.argv[1:3]
    repeats = int(sys.argv[3]) if len(sys.argv) > 3 else DEFAULT_REPEATS
    with tempfile.TemporaryDirectory() as folder:
        command = [os.path.join(build, "esvr2vdb/esvr2vdb"), path, os.path.join(folder, "out.vdb"), "--force"]
        ways = {"Python": lambda: esvr.read(path).grids[0].to_volume().to_numpy(),
                "new Python": lambda: subprocess.run([sys.executable, "-c", NEW_PYTHON, path], check=True),
                "esvr2vdb": lambda: subprocess.run(command, check=True)}
        times = {name: [] for name in ways}
        for _ in range(repeats):
            for name, way in ways.items():
                times[name].append(seconds_of(way))
    medians = {name: statistics.median(values) for name, values in times.items()}
    for name, values in times.items():
        print(f"{name}: {medians[name]:.3f} s ({min(values):.3f} to {max(values):.3f} s), "
              f"{medians[name] / medians['esvr2vdb']:.2f} of esvr2vdb")


main()
