#!/usr/bin/env python3
"""Runs tests of the add-on for Blender: run.py BUILD modules|blender.

`modules` are the tests of the modules without bpy. `blender` are those that run Blender. Exits with 77 if something
that they need is missing, so that CTest shows them as skipped.
"""
import os
import pathlib
import shutil
import sys

HERE = pathlib.Path(__file__).resolve().parent
TESTS = {"modules": ["test_modules.py", "test_decode_and_export.py"],
         "blender": ["test_addon.py"]}


def skip(reason):
    print(f"skipped: {reason}")
    sys.exit(77)


sys.dont_write_bytecode = True
build, part = pathlib.Path(sys.argv[1]).resolve(), sys.argv[2]
os.environ["ESVR_BIN"] = str(build)
sys.path[:0] = [str(HERE.parents[2] / "integrations/blender"), str(build / "python")]
try:
    import numpy  # noqa: F401 (the module esvr needs it)
    import pytest
except ImportError as missing:
    skip(f"{missing} (Debian: python3-numpy, python3-pytest)")
if part == "blender" and not (shutil.which("blender") and shutil.which("xvfb-run")):
    skip("there is no blender or no xvfb-run (Debian: blender, xvfb)")
sys.exit(pytest.main(["-q", "-p", "no:cacheprovider", *(str(HERE / name) for name in TESTS[part])]))
