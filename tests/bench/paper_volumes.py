#!/usr/bin/env python3
"""Makes stand-ins for the volumes of the paper's table "Dataset statistics" that are not available here.

    paper_volumes.py make --bin BUILD --data DATA --out OUT [--only NAME...]
    paper_volumes.py statistics --bin BUILD --data DATA --out OUT [--only NAME...] [--report FILE.json]

A stand-in has the character of the volume that it is named after, the same shares of voxels that are not zero and of
voxels above 10 % of the maximum, and a lower resolution. It is not the volume: figures measured with it say how a format
treats volumes of this kind, and cannot be compared with the paper's. The two volumes of the Hemibrain are rasterised
from skeletons of this data set; all other stand-ins are synthetic, with values of 8 bits. The aneurysm is the original.

`make` writes OUT/NAME.vdb, and keeps a file that exists. `statistics` prints a table with the statistics of the paper
beside those of the stand-ins. Needs numpy and pyopenvdb (Debian: python3-numpy, python3-openvdb).
"""
import argparse
import dataclasses
import json
import pathlib
import tempfile
import typing
import zlib

import numpy as np

from run_program import run

STEPS = 255  # of the values of 8 bits
TENTH = 26  # the lowest value of 8 bits above 10 % of the maximum
VIEWS, SIDE = 4, 400  # number and width of the pictures of which the screen occupancy is the mean
HEADING = """\
| volume | stand-in | resolution of the original | of the stand-in | voxels that are not zero, %: original / stand-in | \
voxels above 10 % of the maximum, %: original / stand-in | screen occupancy, %: original / stand-in |
|---|---|--:|--:|--:|--:|--:|"""
NOTES = f"""\
Screen occupancy is the share of pixels that are not background. The paper's is a mean over the views of its own camera.
That of the stand-ins is a mean over {VIEWS} pictures of a full turn, {SIDE} x {SIDE} pixels, with the default camera and
transfer function of `esvr-render`; as the camera differs, the two cannot be compared closely: the
aneurysm, which is the original, shows by how much they differ. In the volumes of the Hemibrain, the paper has
neurons of a type at more than ten times the resolution; the stand-ins have copies of one neuron with thickened branches."""


# Fields. Lengths are in parts of the longest side, so that a smaller volume shows the same things.

def axes(shape):
    """The coordinates of the voxels, each in an array that broadcasts to the shape. The longest side is 1 long."""
    return np.meshgrid(*((np.arange(n, dtype=np.float32) - (n - 1) / 2) / max(shape) for n in shape),
                       indexing='ij', sparse=True)


def blurred(field, length):
    """A field blurred with a Gaussian whose standard deviation is a length, or one for each axis. It is periodic."""
    lengths = np.broadcast_to(length, 3) * max(field.shape)
    spectrum = np.fft.rfftn(field).astype(np.complex64)
    for axis, (n, sigma) in enumerate(zip(field.shape, lengths)):
        frequency = np.fft.rfftfreq(n) if axis == 2 else np.fft.fftfreq(n)
        form = [1, 1, 1]
        form[axis] = -1
        spectrum *= np.exp(-2 * (np.pi * sigma * frequency) ** 2).astype(np.float32).reshape(form)
    return np.fft.irfftn(spectrum, field.shape).astype(np.float32)


def texture(rng, shape, length):
    """Correlated noise with a mean of 0 and a standard deviation of 1."""
    field = blurred(rng.standard_normal(shape, np.float32), length)
    return (field - field.mean()) / field.std()


def noise(rng, shape):
    """Uncorrelated noise of a scanner, with a standard deviation of 1."""
    return rng.standard_normal(shape, np.float32)


def step(distance, width):
    """1 where a distance is well below 0, 0 where it is well above, with a soft edge of a width."""
    return np.clip(0.5 - distance / width, 0, 1)


def top(field, share):
    """A mask of the voxels with the largest values. It holds a share of all voxels."""
    count = round(share * field.size)
    mask = np.zeros(field.size, bool)
    mask[np.argpartition(field.ravel(), field.size - count)[field.size - count:]] = True
    return mask.reshape(field.shape)


def graded(field, nonzero, above, inside=None):
    """Values of 8 bits, in which a share of all voxels is not zero and a share lies above 10 % of the maximum.

    The voxels with the largest values of `inside`, or else of the field, are not zero. Their grey values follow the field
    by a curve of two straight pieces. The brightest 1/20000 of them have the largest value.
    """
    mask = top(field if inside is None else inside, nonzero) if nonzero < 1 else np.ones(field.shape, bool)
    levels = field[mask]
    lowest, tenth, highest = np.quantile(levels, [0, 1 - above / nonzero, 1 - 1 / 20000])
    bright = levels > tenth if above < nonzero else np.ones(levels.shape, bool)
    grey = np.empty(levels.shape, np.float32)
    grey[bright] = TENTH + (levels[bright] - tenth) / (highest - tenth) * (STEPS - TENTH)
    grey[~bright] = 1 + (levels[~bright] - lowest) / max(tenth - lowest, 1e-9) * (TENTH - 2)
    values = np.zeros(field.shape, np.float32)
    values[mask] = np.clip(np.rint(grey), np.where(bright, TENTH, 1), np.where(bright, STEPS, TENTH - 1))
    return (values / np.float32(STEPS)).astype(np.float32)


# Trees of tubes.

def branches(rng, start, direction, length, radius, *, depth, wiggle, children, taper=0.6):
    """The centers and radii of the balls along a branch and along those that leave it, in voxels."""
    point, direction = np.array(start, float), np.array(direction, float) / np.linalg.norm(direction)
    points, steps = [], max(2, round(length))
    leave = set(rng.integers(steps // 5, steps, children)) if depth else ()
    for i in range(steps):
        direction += rng.normal(0, wiggle, 3)
        direction /= np.linalg.norm(direction)
        point = point + direction
        here = radius * (1 - (1 - taper) * i / steps)
        points.append((*point, here))
        if i in leave:
            side = np.cross(direction, rng.normal(0, 1, 3))
            side = direction * 0.6 + side / np.linalg.norm(side)
            points += branches(rng, point, side, length * rng.uniform(0.35, 0.75), here * 0.75, depth=depth - 1,
                               wiggle=wiggle, children=children, taper=taper)
    return points


def tubes(shape, points, width=1.5, flat=1.0):
    """The largest value at each voxel of balls with soft edges. `flat` stretches them along z."""
    field = np.zeros(shape, np.float32)
    for x, y, z, radius in points:
        reach = np.array([1, 1, flat]) * (radius + width)
        low = np.maximum(np.floor([x, y, z] - reach).astype(int), 0)
        high = np.minimum(np.ceil([x, y, z] + reach).astype(int) + 1, shape)
        if np.any(low >= high):
            continue
        dx, dy, dz = np.ogrid[low[0]:high[0], low[1]:high[1], low[2]:high[2]]
        distance = np.sqrt((dx - x) ** 2 + (dy - y) ** 2 + ((dz - z) / flat) ** 2)
        box = field[low[0]:high[0], low[1]:high[1], low[2]:high[2]]
        np.maximum(box, step(distance - radius, width), out=box)
    return field


# The volumes.

def breast(shape, rng):
    """Vessels, ducts and a few masses of two breasts, cut off at a threshold as in the original."""
    unit = max(shape)
    points = []
    for side in (-1, 1):
        for _ in range(9):
            start = [shape[0] * (0.5 + side * rng.uniform(0.12, 0.36)), shape[1] * rng.uniform(0.8, 0.97),
                     shape[2] * rng.uniform(0.15, 0.85)]
            points += branches(rng, start, [side * rng.normal(0, 0.4), -1, rng.normal(0, 0.35)],
                               unit * rng.uniform(0.3, 0.6), unit * rng.uniform(0.004, 0.0085), depth=3, wiggle=0.11,
                               children=3)
    vessels = tubes(shape, points)
    x, y, z = axes(shape)
    height = shape[2] / unit
    field = vessels * (0.75 + 0.12 * texture(rng, shape, 0.03))
    glands = texture(rng, shape, 0.02) + 0.6 * texture(rng, shape, 0.008)
    for side in (-1, 1):
        dome = np.sqrt(((x - side * 0.24) / 0.2) ** 2 + ((y - 0.08) / 0.3) ** 2 + (z / (0.42 * height)) ** 2)
        field = np.maximum(field, step(dome - 0.75, 0.5) * (0.13 + 0.12 * glands))
    for _ in range(4):  # masses
        cx, cy, cz = rng.choice([-1, 1]) * rng.uniform(0.15, 0.3), rng.uniform(-0.12, 0.2), rng.uniform(-0.25, 0.25) * height
        lump = np.sqrt((x - cx) ** 2 + (y - cy) ** 2 + (z - cz) ** 2) - rng.uniform(0.014, 0.032)
        field = np.maximum(field, step(lump + 0.009 * texture(rng, shape, 0.008), 0.008) * 0.7)
    field += 0.02 * noise(rng, shape)
    return graded(field, 0.0348, 0.0348)


def neuron(shape, rng):
    """Neurons in light microscopy: neurites with a long point spread along z, a background with shot noise."""
    unit = max(shape)
    points = []
    for _ in range(7):
        soma = np.array(shape) * [rng.uniform(0.12, 0.88), rng.uniform(0.15, 0.85), rng.uniform(0.35, 0.65)]
        points += [(*soma, unit * rng.uniform(0.009, 0.013))]
        for _ in range(rng.integers(5, 8)):  # dendrites, and axons, which are thin and long
            points += branches(rng, soma, [*rng.normal(0, 1, 2), rng.normal(0, 0.06)], unit * rng.uniform(0.12, 0.24),
                               unit * rng.uniform(0.0022, 0.0034), depth=2, wiggle=0.07, children=3)
        points += branches(rng, soma, [*rng.normal(0, 1, 2), 0.0], unit * 0.6, unit * 0.0013, depth=2, wiggle=0.06,
                           children=4, taper=0.9)
    points = [(x, y, shape[2] / 2 + (z - shape[2] / 2) * 0.4, r) for x, y, z, r in points]
    bright = blurred(tubes(shape, points, flat=1.6), np.array([0.6, 0.6, 1.2]) / unit)
    stain = bright * (0.62 + 0.1 * texture(rng, shape, 0.01))
    haze = 0.045 + 0.01 * texture(rng, shape, 0.06) + 0.006 * texture(rng, shape, 0.012) + 0.1 * blurred(bright, 0.01)
    light = stain + haze
    light += 0.012 * noise(rng, shape) + 0.06 * np.sqrt(np.maximum(light, 0)) * noise(rng, shape)  # readout, shot noise
    return graded(light, 0.9841, 0.0184)


def bigbrain(shape, rng):
    """A stack of stained sections of a brain: a folded cortex in layers, white matter, a cerebellum with fine folia."""
    x, y, z = axes(shape)
    half = [n / max(shape) / 2 for n in shape]
    folds = texture(rng, shape, 0.022) + 0.35 * texture(rng, shape, 0.012)
    bumps = texture(rng, shape, 0.05)
    hull = np.sqrt((x / half[0] / 0.9) ** 2 + ((y + 0.02) / half[1] / 0.86) ** 2 + ((z - 0.05) / half[2] / 0.82) ** 2)
    depth = (1 - hull) * 0.42 + 0.008 * bumps  # below the hull of the cerebrum
    width = 0.30 * np.clip(1 - depth / 0.14, 0, 1)  # of a sulcus, in units of `folds`
    sulci = (np.abs(folds) - width) * 0.022
    cleft = np.abs(y + 0.004 * bumps) - 0.009 * np.clip((z + 0.02) / 0.1, 0, 1)
    cerebrum = np.minimum(np.minimum(depth, sulci + 0.03 * np.clip(depth - 0.14, 0, 1)), cleft)
    ventricles = 0.04 - np.sqrt(((x + 0.02) / 3.2) ** 2 + ((np.abs(y) - 0.045) / 0.7) ** 2 + (z - 0.06) ** 2)
    cerebrum = np.minimum(cerebrum, -ventricles * 0.5)
    round_ = np.sqrt(((x + 0.27) / 1.1) ** 2 + (y / 1.6) ** 2 + ((z + 0.26) / 0.8) ** 2)
    angle = np.arctan2(z + 0.22, x + 0.3)
    folia = np.cos(66 * angle + 3.0 * bumps + 30 * round_)
    cerebellum = np.minimum(0.145 - round_ + 0.004 * bumps, 0.006 * (folia + 0.75 + 8 * (0.12 - round_)))
    stem = 0.055 - np.hypot(x + 0.1 + 0.12 * z, y) + 0 * z
    stem = np.where((z < -0.1) & (z > -0.42 * half[2] / 0.5), stem, -1)
    inside = np.maximum(np.maximum(cerebrum, cerebellum), stem)
    brain = top(inside, 0.2946)
    grey = blurred(brain.astype(np.float32), 0.010)  # 1/2 at the surface, 1 in the depth
    layers = 0.06 * np.cos(np.clip(grey - 0.5, 0, 0.5) * 2 * np.pi * 5)
    cortex = step(grey - 0.965, 0.04)
    fine = texture(rng, shape, 0.0035)
    stain = 0.36 + 0.05 * texture(rng, shape, 0.04) + cortex * (0.34 + layers) + 0.05 * fine
    section = np.ones((shape[0], 1, 1), np.float32)
    stain *= section + 0.05 * noise(rng, (shape[0], 1, 1)) \
        + 0.03 * texture(rng, shape, [1e-5, 0.05, 0.05])  # the stain of each section differs
    stain += 0.035 * noise(rng, shape)
    return graded(stain, 0.2946, 0.2943, np.where(brain, 1 + stain * 0, -1))


def woodbranch(shape, rng):
    """A branch in micro-CT: thin-walled cells along its axis, rings with thick-walled late wood, rays, pith, bark."""
    x, y, z = axes(shape)
    warp = 0.010 * texture(rng, shape, [0.12, 0.12, 0.3])
    radius = np.hypot(x + 0.02, y - 0.015 + 0.03 * z) * (1 + 0.05 * np.cos(3 * np.arctan2(y, x) + 1)) + warp
    angle = np.arctan2(y - 0.015 + 0.03 * z, x + 0.02)
    bark = 0.36
    ring = np.mod(radius, 0.075) / 0.075  # the position within a year's ring
    late = np.clip((ring - 0.72) / 0.2, 0, 1) * step(np.abs(ring - 0.84) - 0.15, 0.04)
    # Cells are the cells of a honeycomb of waves in the plane of the cut, with slow distortions along the axis.
    pitch, bend = 0.030, 0.0045
    u = x + bend * texture(rng, shape, [0.03, 0.03, 0.1])
    v = y + bend * texture(rng, shape, [0.03, 0.03, 0.1]) + 0.03 * z
    waves = [np.cos(2 * np.pi / pitch * (u * np.cos(a) + v * np.sin(a))) for a in (0.2, 0.2 + np.pi / 3, 0.2 + 2 * np.pi / 3)]
    lumen = (waves[0] + waves[1] + waves[2] + 1.5) / 4.5  # 1 in the middle of a cell, 0 where three walls meet
    wall = step(lumen - (0.16 + 0.22 * late), 0.14)
    vessel = top(texture(rng, shape, [0.008, 0.008, 0.08]) - 1.5 * late, 0.06)  # wide tubes of early wood
    wall = np.where(vessel, 0.0, wall)
    rays = step(np.abs(np.sin(30 * angle + 2 * warp / 0.01)) - 0.10, 0.06) * (np.cos(2 * np.pi * z / 0.2 + 40 * radius) > -0.4)
    wood = np.maximum(wall * (0.45 + 0.5 * late), 0.5 * rays)
    pith = step(radius - 0.03, 0.01)
    wood = wood * (1 - 0.75 * pith)
    rind = step(np.abs(radius - bark) - 0.016, 0.008) * (0.3 + 0.1 * texture(rng, shape, 0.008))
    field = np.where(radius < bark, wood, 0) + rind
    field = blurred(field, 0.6 / max(shape))
    grains = top(texture(rng, shape, 0.0035) - 9 * (radius > bark), 2e-5)  # minerals, the brightest voxels
    field = 0.14 + 0.8 * field + np.where(radius < bark, 0.025, 0)
    field += 0.02 * texture(rng, shape, 0.004) + 0.055 * noise(rng, shape) + 0.5 * grains
    return graded(field, 0.8489, 0.0329)


def beechnut(shape, rng):
    """A dried beechnut in micro-CT: a shell with three keels, a shrunken, folded kernel, a holder, noise, ring artefacts."""
    x, y, z = axes(shape)
    length = shape[2] / max(shape)
    bumps = texture(rng, shape, 0.05)
    angle, radius = np.arctan2(y, x), np.hypot(x, y)
    along = np.clip((z / length + 0.43) / 0.86, 0, 1)  # 0 and 1 at the ends of the nut
    belly = 0.25 * np.maximum(np.sin(np.pi * along), 0) ** 0.7 * (1 - 0.35 * (along - 0.4))
    outline = belly * (1 + 0.16 * np.cos(3 * angle + 0.6 * z) + 0.03 * np.cos(6 * angle)) + 0.003 * bumps
    depth = np.where((along > 0) & (along < 1), outline - radius, -0.1)
    fibres = texture(rng, shape, [0.004, 0.004, 0.03])
    shell = step(np.abs(depth - 0.012) - 0.010, 0.005) * (0.72 + 0.06 * fibres)
    folds = texture(rng, shape, [0.03, 0.03, 0.06])
    gap = step(np.abs(folds) - 0.13, 0.06)
    kernel = step(0.042 + 0.006 * bumps - depth, 0.006) * step(np.abs(z) - 0.34 * length, 0.02)
    kernel = kernel * (1 - gap) * (0.5 + 0.03 * texture(rng, shape, 0.01) + 0.02 * texture(rng, shape, 0.004))
    skin = step(np.abs(depth - 0.034 - 0.004 * bumps) - 0.003, 0.003) * 0.4
    holder = step(np.abs(radius - 0.318) - 0.004, 0.003) * 0.35
    stick = step(np.hypot(x, y) - 0.05, 0.01) * step(z + 0.43 * length, 0.01) * 0.45
    field = np.maximum.reduce([shell, kernel, skin + 0 * x, holder + 0 * z, stick])
    field = blurred(field, 0.5 / max(shape))
    rings = np.interp(radius, np.linspace(0, 0.5, 300), rng.standard_normal(300)).astype(np.float32)
    field = 0.3 + 0.6 * field + 0.006 * rings + 0.012 * texture(rng, shape, 0.008) + 0.035 * noise(rng, shape)
    return graded(field, 1.0, 1.0)


def pigheart(shape, rng):
    """A heart in CT: muscle with fibres, chambers, fat and contrasted vessels in a bath, noise, a dark rim of the scanner."""
    x, y, z = axes(shape)
    unit = max(shape)
    bumps = texture(rng, shape, 0.06)
    tip = np.clip((z + 0.42) / 0.5, 0.02, 1) ** 0.55  # narrower towards the apex
    heart = 0.30 * tip * (1 - 0.6 * np.clip(z - 0.2, 0, 1)) - np.hypot(x, y * 1.08) + 0.008 * bumps
    heart = np.minimum(heart, 0.40 - np.abs(z) + 0.01 * bumps)
    left = 0.10 * np.clip((z + 0.3) / 0.4, 0.05, 1) ** 0.5 - np.hypot(x + 0.06, (y + 0.03) * 1.15) + 0.012 * bumps
    right = 0.075 - np.hypot((x - 0.11) * 1.5, (y - 0.02) * 0.65) + 0.012 * texture(rng, shape, 0.03)
    left, right = np.minimum(left, 0.3 - np.abs(z)), np.minimum(right, 0.24 - np.abs(z - 0.06))
    fibres = texture(rng, shape, [0.02, 0.02, 0.004]) + texture(rng, shape, [0.004, 0.02, 0.02])
    muscle = step(-heart, 0.006) * (0.50 + 0.022 * fibres + 0.02 * texture(rng, shape, 0.03))
    fat = step(np.abs(heart - 0.012) - 0.012 - 0.010 * texture(rng, shape, 0.04), 0.006)
    field = np.where(fat > 0.5, 0.36 + 0.03 * texture(rng, shape, 0.01), muscle)
    blood = np.maximum(step(-left, 0.006), step(-right, 0.006))
    field = field * (1 - blood) + blood * (0.30 + 0.02 * texture(rng, shape, 0.02))
    points = []
    for k in range(9):  # coronary vessels run down the surface
        turn, height = 2 * np.pi * (k + rng.uniform(0, 0.5)) / 9, 0.25
        start = np.array(shape) / 2 + unit * np.array([0.24 * np.cos(turn), 0.22 * np.sin(turn), height])
        points += branches(rng, start, [-0.16 * np.cos(turn), -0.16 * np.sin(turn), -1.0], unit * 0.42, unit * 0.010,
                           depth=2, wiggle=0.05, children=3)
    field = np.maximum(field, tubes(shape, points) * step(-heart, 0.01) * (0.86 + 0.03 * bumps))
    vessel = np.abs(np.hypot(x + 0.05, y + 0.02 - 0.25 * (z - 0.3)) - 0.06) - 0.012  # the aorta's wall
    field = np.maximum(field, step(vessel, 0.006) * (z > 0.22) * 0.55)
    bath = np.hypot(x, y)
    room = step(bath - 0.378, 0.004) * (np.abs(z) < 0.49)
    field = np.maximum(field, room * (0.22 + 0.012 * texture(rng, shape, 0.05)))
    field = np.maximum(field, step(np.abs(bath - 0.384) - 0.006, 0.004) * 0.45)
    field = blurred(field, 0.5 / unit)
    field += 0.05 + 0.01 * texture(rng, shape, 0.006) + 0.035 * noise(rng, shape)
    return graded(field, 1.0, 0.846)


@dataclasses.dataclass(frozen=True)
class Statistics:
    """Of a volume, in %; the paper's are those of its table "Dataset statistics"."""
    resolution: tuple
    nonzero: float
    above: float
    screen: float


@dataclasses.dataclass(frozen=True)
class Dense:
    """A synthetic stand-in."""
    title: str
    what: str
    original: Statistics
    resolution: tuple
    values: typing.Callable
    seed: int

    def array(self, scale=1.0):
        """The values; `scale` makes a smaller volume of the same kind."""
        shape = tuple(max(8, round(n * scale)) for n in self.resolution)
        return self.values(shape, np.random.default_rng(self.seed))

    def make(self, _, path):
        import pyopenvdb
        values = self.array()
        grid = pyopenvdb.FloatGrid(background=0.0)
        if values.min() > 0:  # the tolerance of copyFromArray leaves out voxels near the background
            grid.fill((0, 0, 0), tuple(n - 1 for n in values.shape), 1.0, active=True)
        grid.copyFromArray(values)
        grid.name, grid.gridClass = 'density', pyopenvdb.GridClass.FOG_VOLUME
        pyopenvdb.write(str(path), [grid])

    @property
    def box(self):
        return ','.join(str(n) for n in (0, 0, 0, *(n - 1 for n in self.resolution)))


def turned(nodes, rng, copies):
    """The rows of a skeleton (number, label, x, y, z, radius, parent) and of copies, each turned about its middle."""
    numbers = np.unique(nodes[:, 0])
    middle, found = (nodes[:, 2:5].min(axis=0) + nodes[:, 2:5].max(axis=0)) / 2, [nodes]
    for k in range(1, copies):
        turn, triangle = np.linalg.qr(rng.normal(size=(3, 3)))
        turn *= np.sign(np.diag(triangle))
        turn[:, 0] *= np.linalg.det(turn)  # no mirror image
        copy = nodes.copy()
        copy[:, 2:5] = (nodes[:, 2:5] - middle) @ turn.T + middle
        copy[:, 0] += k * (numbers[-1] + 1)
        copy[:, 6] = np.where(nodes[:, 6] < 0, -1, nodes[:, 6] + k * (numbers[-1] + 1))
        found.append(copy)
    return np.concatenate(found)


@dataclasses.dataclass(frozen=True)
class Skeletons:
    """A stand-in that swc2vdb rasterises from turned copies of DATA/swc/NAME.swc."""
    title: str
    what: str
    original: Statistics
    name: str
    copies: int
    seed: int
    options: tuple
    box = None  # that of the active voxels

    def make(self, options, path):
        nodes = np.loadtxt(options.data / f'swc/{self.name}.swc', comments='#')
        with tempfile.TemporaryDirectory() as folder:
            skeleton = pathlib.Path(folder) / f'{self.name}.swc'
            np.savetxt(skeleton, turned(nodes, np.random.default_rng(self.seed), self.copies), '%d %d %.9g %.9g %.9g %.9g %d')
            run([options.bin / 'samples/swc2vdb', skeleton, path, *self.options])


@dataclasses.dataclass(frozen=True)
class Original:
    """A volume of the paper that DATA holds."""
    title: str
    what: str
    original: Statistics
    file: str
    resolution: tuple

    def make(self, options, path):
        path.write_bytes((options.data / self.file).read_bytes())

    box = Dense.box


def skeletons(title, original, name, copies, seed, *options):
    what = f"{copies} turned copies of a neuron of the Hemibrain, `swc2vdb {name}.swc {' '.join(options)}`"
    return Skeletons(title, what, original, name, copies, seed, options)


VOLUMES = {
    'aneurysm': Original('Aneurysm', 'the original', Statistics((256, 256, 256), 0.64, 0.64, 23), 'aneurism.vdb',
                         (256, 256, 256)),
    'breast': Dense('Breast', 'vessels, ducts and masses above a threshold; noise of 2 %',
                    Statistics((448, 448, 160), 3.48, 3.48, 27), (320, 320, 114), breast, 11),
    'neuron': Dense('Neuron', 'thin neurites in light microscopy; a faint background with shot noise everywhere',
                    Statistics((2537, 1295, 133), 98.41, 1.84, 31), (634, 324, 33), neuron, 12),
    'bigbrain': Dense('BigBrain', 'stained sections of a brain with a folded cortex in layers; each section has its own '
                      'stain, noise of 3.5 %', Statistics((1749, 1643, 1428), 29.46, 29.43, 53), (297, 279, 243), bigbrain,
                      13),
    'woodbranch': Dense('Woodbranch', 'cells with thin walls, rings, rays and bark in micro-CT; faint noise nearly everywhere',
                        Statistics((2048, 2048, 2048), 84.89, 3.29, 54), (288, 288, 288), woodbranch, 14),
    'vdeltaa': skeletons('Hemibrain (vDeltaA)', Statistics((4072, 4372, 4171), 0.30, 0.29, 23), 'hemibrain_754538881',
                         6, 17, '--resolution', '320', '--min-radius', '1.1', '--edge', '0.1'),
    'lln2p': skeletons('Hemibrain (lLN2P)', Statistics((5115, 4774, 6128), 0.34, 0.34, 27), 'hemibrain_722817260',
                       8, 18, '--resolution', '320', '--min-radius', '1.2', '--edge', '0.1'),
    'beechnut': Dense('Beechnut', 'a nut with a shell, a folded kernel and ring artefacts in micro-CT; noise of 3.5 %',
                      Statistics((1024, 1024, 1546), 100.0, 100.0, 55), (256, 256, 386), beechnut, 15),
    'pigheart': Dense('Pigheart', 'a heart in a bath in CT, with muscle, fat, chambers and vessels; noise of 3.5 %',
                      Statistics((2048, 2048, 2612), 100.0, 84.60, 68), (256, 256, 326), pigheart, 16),
}


def path_of(options, name):
    return options.out / f'{name}.vdb'


def make(options):
    options.out.mkdir(parents=True, exist_ok=True)
    for name in options.only:
        path = path_of(options, name)
        if not path.exists():
            VOLUMES[name].make(options, path)
        print(f'{path}: {path.stat().st_size} bytes', flush=True)


# Statistics.

def stored(path, box=None):
    """The voxels of a file's first grid in a box, or else in the box of the active voxels."""
    import external_compressors
    return external_compressors.dense(path, box)


def shares(values):
    """The parts of all voxels, in %, that are not zero and that lie above 10 % of the maximum."""
    return 100 * float(np.mean(values != 0)), 100 * float(np.mean(values > 0.1 * values.max()))


def pixels(path):
    """The pixels of a PNG file with 8 bits a channel, as an array of height, width and channels."""
    content, position, packed = path.read_bytes(), 8, b''
    while position < len(content):
        length, kind = int.from_bytes(content[position:position + 4], 'big'), content[position + 4:position + 8]
        chunk = content[position + 8:position + 8 + length]
        position += 12 + length
        if kind == b'IHDR':
            width, height = int.from_bytes(chunk[:4], 'big'), int.from_bytes(chunk[4:8], 'big')
            bits, channels = chunk[8], {0: 1, 2: 3, 4: 2, 6: 4}[chunk[9]]
            assert bits == 8 and chunk[12] == 0, 'only pictures of 8 bits that are not interlaced'
        elif kind == b'IDAT':
            packed += chunk
    lines = np.frombuffer(zlib.decompress(packed), np.uint8).reshape(height, 1 + width * channels)
    above, rows = np.zeros((width, channels), int), []
    for line in lines:
        row = line[1:].reshape(width, channels).astype(int)
        if line[0] == 1:
            row = np.cumsum(row, axis=0)
        elif line[0] == 2:
            row = row + above
        elif line[0]:
            row = unfiltered(row, above, {3: mean, 4: paeth}[line[0]])
        above = row & 255
        rows.append(above)
    return np.array(rows, np.uint8)


def mean(left, above, _):
    return (left + above) // 2


def paeth(left, above, corner):
    """The neighbour nearest to left + above - corner, as PNG defines it."""
    guess = left + above - corner
    to_left, to_above, to_corner = abs(guess - left), abs(guess - above), abs(guess - corner)
    if to_left <= to_above and to_left <= to_corner:
        return left
    return above if to_above <= to_corner else corner


def unfiltered(row, above, guess):
    """A row whose bytes are differences to what is guessed from three neighbours."""
    done, tops = [[0] * row.shape[1]] + [None] * len(row), [[0] * row.shape[1]] + above.tolist()
    for i, values in enumerate(row.tolist()):
        done[i + 1] = [(v + guess(done[i][c], tops[i + 1][c], tops[i][c])) & 255 for c, v in enumerate(values)]
    return np.array(done[1:])


def screen(options, name):
    """The share of pixels, in %, that are not the background in pictures of the volume."""
    folder = options.out / 'pictures' / name
    folder.mkdir(parents=True, exist_ok=True)
    run([options.bin / 'render/esvr-render', path_of(options, name), f'{folder}/view.####.png', '--turntable', VIEWS,
         '--resolution', f'{SIDE}x{SIDE}', '--background', '0,0,0', '--colors', 'viridis', '--opacity', 'linear',
         '--device', 'cpu', '-f', '-q'])
    pictures = [pixels(file)[..., :3] for file in sorted(folder.glob('view.*.png'))]
    assert len(pictures) == VIEWS, folder
    return 100 * float(np.mean([picture.any(axis=-1).mean() for picture in pictures]))


def measured(options, name):
    volume, path = VOLUMES[name], path_of(options, name)
    values = stored(path, volume.box)
    nonzero, above = shares(values)
    return {'name': name, 'title': volume.title, 'what': volume.what, 'original': dataclasses.asdict(volume.original),
            'bytes': path.stat().st_size, 'box': volume.box,
            'measured': dataclasses.asdict(Statistics(values.shape, nonzero, above, screen(options, name)))}


def resolution(numbers):
    return ' x '.join(map(str, numbers))


def table(rows):
    lines = [HEADING]
    for row in rows:
        old, new = row['original'], row['measured']
        lines.append(f"| {row['title']} | {row['what']} | {resolution(old['resolution'])} | {resolution(new['resolution'])} | "
                     f"{old['nonzero']:.2f} / {new['nonzero']:.2f} | {old['above']:.2f} / {new['above']:.2f} | "
                     f"{old['screen']:.0f} / {new['screen']:.0f} |")
    return '\n'.join([*lines, '', NOTES])


def statistics(options):
    make(options)
    rows = [measured(options, name) for name in options.only]
    print(table(rows))
    if options.report:
        options.report.write_text(json.dumps({'views': VIEWS, 'volumes': rows}, indent=1) + '\n')


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('job', choices=('make', 'statistics'))
    parser.add_argument('--bin', type=pathlib.Path, required=True, help='the build folder')
    parser.add_argument('--data', type=pathlib.Path, required=True)
    parser.add_argument('--out', type=pathlib.Path, required=True)
    parser.add_argument('--only', nargs='+', choices=VOLUMES, default=list(VOLUMES), metavar='NAME')
    parser.add_argument('--report', type=pathlib.Path)
    options = parser.parse_args()
    {'make': make, 'statistics': statistics}[options.job](options)


if __name__ == '__main__':
    main()
