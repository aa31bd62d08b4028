#!/usr/bin/env python3
"""coarser.py BUILD VDB_LOD FILE.vdb...: compares coarser grids of esvr2vdb --coarsen with those of OpenVDB's vdb_lod.

Prints a row for each file, factor and program, as in docs/figures/benchmarks.md: the bytes and the seconds of the
program, and the errors of its voxels against the average of the source over the space of each coarse voxel, which is
computed here in float64 at the places that the transform of the output says. vdb_lod reads the source, and esvr2vdb a
lossless file, a file with --max-error 1%, and the ellipsoids of --psnr 40 --representation ellipsoids.
"""
import pathlib
import subprocess
import sys
import tempfile
import time

import numpy as np


def run(*words):
    start = time.perf_counter()
    subprocess.run([str(word) for word in words], check=True, capture_output=True)
    return time.perf_counter() - start


def parts(centers, width, first, count):
    """For each center, the part of each of `count` voxels from `first` on in the space of a coarse voxel."""
    low, high = centers - width / 2, centers + width / 2
    at = first + np.arange(count)
    overlap = np.minimum(high[:, None], at + 0.5) - np.maximum(low[:, None], at - 0.5)
    return np.maximum(overlap, 0.0) / width


class Source:
    """The voxels of a file with a margin of the background, in float64."""

    def __init__(self, path, esvr):
        self.volume = esvr.Volume.from_vdb(path)
        (x0, y0, z0), (x1, y1, z1) = self.volume.box
        self.first = np.array([x0, y0, z0]) - 16
        box = (tuple(self.first), (x1 + 16, y1 + 16, z1 + 16))
        self.values = self.volume.to_numpy(box).astype(np.float64)

    def averages(self, coarse):
        """The voxels of a coarse volume over its box, and what they should be."""
        low, high = (np.array(corner) for corner in coarse.box)
        to_fine = np.linalg.inv(self.volume.transform) @ coarse.transform
        expected = self.values
        for axis in range(3):
            index = np.arange(low[axis], high[axis] + 1)
            centers = to_fine[axis, axis] * index + to_fine[axis, 3]
            weights = parts(centers, to_fine[axis, axis], self.first[axis], self.values.shape[axis])
            expected = np.moveaxis(np.tensordot(weights, expected, (1, axis)), 0, axis)
        return coarse.to_numpy((tuple(low), tuple(high))).astype(np.float64), expected


def report(name, factor, program, seconds, output, source, esvr):
    made, expected = source.averages(esvr.Volume.from_vdb(output))
    error = np.abs(made - expected)
    scale = source.values.max() - source.values.min()
    print(f"| {name} | {factor} | {program} | {output.stat().st_size} | {seconds:.2f} | "
          f"{error.max() / scale:.2g} | {np.sqrt((error ** 2).mean()) / scale:.2g} |", flush=True)


def main():
    build, vdb_lod, *paths = sys.argv[1:]
    sys.path.insert(0, str(pathlib.Path(build) / "python"))
    import esvr
    vdb2esvr, esvr2vdb = (pathlib.Path(build) / name / name for name in ("vdb2esvr", "esvr2vdb"))
    print("| file | factor | program | bytes | seconds | largest error | RMS error |\n|---|---:|---|---:|---:|---:|---:|")
    with tempfile.TemporaryDirectory() as temporary:
        folder = pathlib.Path(temporary)
        for path in map(pathlib.Path, paths):
            source = Source(path, esvr)
            made = {"lossless": ["--lossless"], "1 %": ["--max-error", "1%"],
                    "ellipsoids": ["--psnr", "40", "--representation", "ellipsoids"]}
            for kind, goal in made.items():
                run(vdb2esvr, path, folder / f"{kind}.esvr", "-f", *goal)
            for level in (1, 2, 3):
                factor = 2 ** level
                seconds = run(vdb_lod, path, folder / "lod.vdb", "-range", level, "-p")
                report(path.stem, factor, "vdb_lod", seconds, folder / "lod.vdb", source, esvr)
                for kind in made:
                    seconds = run(esvr2vdb, folder / f"{kind}.esvr", folder / "coarse.vdb", "-f", "--coarsen", factor)
                    report(path.stem, factor, f"esvr2vdb, {kind}", seconds, folder / "coarse.vdb", source, esvr)


main()
