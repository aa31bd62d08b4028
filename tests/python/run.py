#!/usr/bin/env python3
"""Runs the tests of a folder: run.py PACKAGES REPORT TESTS OPTION..., where PACKAGES is a folder that has the package esvr,
and REPORT is a file for the results, which .ci/report_tests reads.

Exits with 77 if pytest or NumPy is missing, so that CTest shows the tests as skipped.
"""
import sys


def main():
    sys.dont_write_bytecode = True
    sys.path.insert(0, sys.argv[1])
    try:
        import numpy  # noqa: F401
        import pytest
    except ImportError as missing:
        print(f"skipped: {missing} (Debian: python3-numpy, python3-pytest)")
        return 77
    return pytest.main(["-q", "-p", "no:cacheprovider", "-rs", f"--junit-xml={sys.argv[2]}", *sys.argv[3:]])


# A process that multiprocessing starts imports this file, and must not run the tests again.
if __name__ == "__main__":
    sys.exit(main())
