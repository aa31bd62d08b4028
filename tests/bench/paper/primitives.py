#!/usr/bin/env python3
"""Draws the ellipsoids of a file by their fractional anisotropy (FA) and by their importance, for docs/paper.md.

    primitives.py FILE.esvr --bin BUILD --out OUT.png

Each ellipsoid is drawn up to one scale from its center. Where several overlap, the picture shows the one with the highest
figure. FA is that of the squared scales, and the importance the paper's score |coverage| * intensity * FA, shown by its
rank among all ellipsoids. Needs numpy, pyopenvdb and PIL (Debian: python3-numpy, python3-openvdb, python3-pil), and the
module esvr of the build (PYTHONPATH=BUILD/python).
"""
import argparse
import pathlib
import sys
import tempfile

import numpy as np
import pyopenvdb
from PIL import Image

import esvr

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from run_program import run  # noqa: E402

PICTURE = ["--resolution", "700x700", "--mode", "maximum", "--colors", "inferno", "--background", "0,0,0", "--fov",
           "22", "-q", "-f"]
FAINTEST = 0.02  # of ellipsoids with the lowest figure, so that they differ from the background


def anisotropy(scales):
    """The fractional anisotropy of the squared scales, from 0 for a sphere to 1 for a needle."""
    squares = scales.astype(np.float64) ** 2
    spread = np.sum((squares - squares.mean(axis=1, keepdims=True)) ** 2, axis=1)
    return np.sqrt(1.5 * spread / np.sum(squares ** 2, axis=1))


def ranks(values):
    """The rank of each value, from 0 to 1."""
    return np.argsort(np.argsort(values)) / max(len(values) - 1, 1)


def axes(quaternions):
    """The rotation matrices of quaternions (w, x, y, z)."""
    w, x, y, z = quaternions.astype(np.float64).T
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                     [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                     [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]]).transpose(2, 0, 1)


def paint(grid, figures, low, shape):
    """An array with the highest figure of the ellipsoids that contain a voxel."""
    voxels = np.zeros(shape, np.float32)
    for center, scale, turn, figure in zip(grid.mu - low, grid.scale, axes(grid.quaternion), figures):
        reach = np.sqrt(((turn * scale) ** 2).sum(axis=1))
        first = np.maximum(np.ceil(center - reach).astype(int), 0)
        last = np.minimum(np.floor(center + reach).astype(int) + 1, shape)
        if np.any(first >= last):
            continue
        places = np.stack(np.meshgrid(*map(np.arange, first, last), indexing="ij"), axis=-1) - center
        inside = (((places @ turn) / scale) ** 2).sum(axis=-1) <= 1
        part = voxels[tuple(slice(a, b) for a, b in zip(first, last))]
        np.maximum(part, np.where(inside, figure, 0), out=part)
    return voxels


def draw(arguments, voxels, folder, name):
    volume, picture = folder / f"{name}.vdb", folder / f"{name}.png"
    grid = pyopenvdb.FloatGrid()
    grid.copyFromArray(voxels)
    grid.name = "density"
    pyopenvdb.write(str(volume), [grid])
    run([arguments.bin / "render/esvr-render", volume, picture, "--range", "0,1", *PICTURE])
    return Image.open(picture).convert("RGB")


def side_by_side(pictures):
    """The pictures without the background around their contents."""
    boxes = [picture.getbbox() for picture in pictures]
    box = (*map(min, zip(*(b[:2] for b in boxes))), *map(max, zip(*(b[2:] for b in boxes))))
    parts = [picture.crop(box) for picture in pictures]
    sheet = Image.new("RGB", (sum(p.width for p in parts), parts[0].height))
    for index, part in enumerate(parts):
        sheet.paste(part, (index * part.width, 0))
    return sheet


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", type=pathlib.Path)
    parser.add_argument("--bin", type=pathlib.Path, required=True)
    parser.add_argument("--out", type=pathlib.Path, required=True)
    arguments = parser.parse_args()
    grid = esvr.read(str(arguments.file)).grids[0]
    low, high = np.array(grid.box)
    ellipsoids = grid.ellipsoids
    fa = anisotropy(ellipsoids.scale)
    score = ellipsoids.scale.astype(np.float64).prod(axis=1) * np.abs(ellipsoids.intensity) * fa
    with tempfile.TemporaryDirectory() as name:
        pictures = [draw(arguments, paint(ellipsoids, np.maximum(figure, FAINTEST), low, high - low + 1),
                         pathlib.Path(name), part) for part, figure in (("fa", fa), ("importance", ranks(score)))]
    sheet = side_by_side(pictures)
    sheet.save(arguments.out, optimize=True)
    print(f"{len(fa)} ellipsoids, mean FA {fa.mean():.2f}")


if __name__ == "__main__":
    main()
