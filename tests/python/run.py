#!/usr/bin/env python3
"""Runs the tests of this folder: run.py FOLDER, where FOLDER has the package esvr.

Exits with 77 if pytest or NumPy is missing, so that CTest shows the tests as skipped.
"""
import pathlib
import sys

sys.dont_write_bytecode = True
sys.path.insert(0, sys.argv[1])
try:
    import numpy  # noqa: F401
    import pytest
except ImportError as missing:
    print(f"skipped: {missing} (Debian: python3-numpy, python3-pytest)")
    sys.exit(77)
sys.exit(pytest.main(["-q", "-p", "no:cacheprovider", str(pathlib.Path(__file__).parent)]))
