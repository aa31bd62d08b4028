#!/usr/bin/env python3
"""Measures how long Python takes to read and decode a file, against esvr2vdb:

    PYTHONPATH=BUILD/python python3 tests/bench/python_read.py BUILD FILE.esvr [REPEATS]

The two take turns. Python has imported the module before; esvr2vdb is a new process each time, and writes a .vdb file
into a temporary folder. Prints the medians and their quotient.
"""
import os
import statistics
import subprocess
import sys
import tempfile
import time

import esvr

DEFAULT_REPEATS = 5


def seconds_of(function):
    start = time.perf_counter()
    function()
    return time.perf_counter() - start


def main():
    build, path = sys.argv[1:3]
    repeats = int(sys.argv[3]) if len(sys.argv) > 3 else DEFAULT_REPEATS
    program = os.path.join(build, "esvr2vdb/esvr2vdb")
    times = {"Python": [], "esvr2vdb": []}
    with tempfile.TemporaryDirectory() as folder:
        command = [program, path, os.path.join(folder, "out.vdb"), "--force"]
        for _ in range(repeats):
            times["Python"].append(seconds_of(lambda: esvr.read(path).grids[0].to_volume().to_numpy()))
            times["esvr2vdb"].append(seconds_of(lambda: subprocess.run(command, check=True)))
    for name, values in times.items():
        print(f"{name}: {statistics.median(values):.3f} s, {min(values):.3f} to {max(values):.3f} s")
    print(f"Python / esvr2vdb: {statistics.median(times['Python']) / statistics.median(times['esvr2vdb']):.2f}")


main()
