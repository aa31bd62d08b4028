#!/usr/bin/env python3
"""Runs the test of ParaView's reader: run.py BUILD.

Debian's ParaView draws in windows only, which xvfb-run keeps in memory. Exits with 77 where one of the two is missing.
"""
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
PLUGIN = HERE.parents[1] / "integrations/paraview"

if not shutil.which("pvbatch") or not shutil.which("xvfb-run"):
    print("skipped: there is no pvbatch (Debian: paraview) or no xvfb-run (Debian: xvfb)")
    sys.exit(77)
build = pathlib.Path(sys.argv[1]).resolve()
paths = [str(build / "python"), str(PLUGIN / "debian12")]
environment = {**os.environ, "PYTHONPATH": os.pathsep.join(paths), "ESVR_PLUGIN": str(PLUGIN / "esvr_reader.py"),
               "ESVR_BIN": str(build)}
with tempfile.TemporaryDirectory() as folder:
    # ParaView opens and closes a connection before that of its window. Without -noreset, the server begins
    # anew in between and may refuse the second one.
    server = ["xvfb-run", "-a", "-s", "-screen 0 800x600x24 -noreset"]
    done = subprocess.run([*server, "pvbatch", str(HERE / "reader_check.py")], cwd=folder, env=environment, text=True,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=300)
print(done.stdout)
# pvbatch may end with 0 after an exception, so that the last line decides.
sys.exit(0 if done.stdout.rstrip().endswith("all checks passed") else 1)
