"""Makes the volumes of the section "Unseen volumes" of docs/comparison.md.

No setting of ESVR was chosen with these volumes, and nobody looked at them before they were measured. Each is
one grid in a file of its own. Needs numpy and pyopenvdb (Debian: python3-numpy, python3-openvdb).
"""
import numpy as np
import pyopenvdb

from run_program import run

HALF_WIDTH = 3.0  # of narrow bands, voxels


def sample(kind, resolution, seed):
    """A volume of esvr-sample."""
    def make(options, path):
        run([options.bin / 'samples/esvr-sample', kind, path, '--resolution', resolution, '--seed', seed])
    return make


def skeleton(name, resolution):
    """A neuron's skeleton at a resolution that is used nowhere else."""
    def make(options, path):
        run([options.bin / 'samples/swc2vdb', options.data / f'swc/{name}.swc', path,
             '--resolution', resolution])
    return make


def grid_of(folder, file, grid):
    """One grid of a file that has several."""
    def make(options, path):
        pyopenvdb.write(str(path), [pyopenvdb.read(str(options.data / folder / f'{file}.vdb'), grid)])
    return make


def coordinates(side):
    """The coordinates of the voxels of a cube, relative to its center."""
    axis = np.arange(side) - (side - 1) / 2
    return np.meshgrid(axis, axis, axis, indexing='ij')


def surface(distance, side):
    """A level set of the surface where a function of coordinates is 0. The function is negative inside."""
    def make(_, path):
        values = pyopenvdb.FloatGrid(background=float(side))
        values.copyFromArray(distance(*coordinates(side)).astype(np.float32))
        points, triangles, quads = values.convertToPolygons(isovalue=0.0, adaptivity=0.0)
        grid = pyopenvdb.FloatGrid.createLevelSetFromPolygons(
            points, triangles=triangles, quads=quads,
            transform=pyopenvdb.createLinearTransform(1.0), halfWidth=HALF_WIDTH)
        grid.name = 'surface'
        pyopenvdb.write(str(path), [grid])
    return make


def torus(x, y, z):
    return np.hypot(np.hypot(x, y) - 40.0, z) - 14.0


def gyroid_ball(x, y, z):
    """The walls of a gyroid with a period of 30 voxels within a ball."""
    a, b, c = (2 * np.pi / 30 * v for v in (x, y, z))
    wall = np.abs(np.sin(a) * np.cos(b) + np.sin(b) * np.cos(c) + np.sin(c) * np.cos(a)) - 0.5
    ball = np.sqrt(x * x + y * y + z * z) - 42.0
    return np.maximum(wall * 4.0, ball)


def sphere(_, path):
    grid = pyopenvdb.createLevelSetSphere(radius=50.0, voxelSize=1.0, halfWidth=HALF_WIDTH)
    grid.name = 'surface'
    pyopenvdb.write(str(path), [grid])


def scan(_, path):
    """Like a dense CT scan of 8 bits: nested ellipsoids with noise."""
    x, y, z = coordinates(80)
    values = np.zeros(x.shape)
    for value, *radii in ((0.35, 36, 30, 38), (0.75, 33, 27, 35), (0.5, 30, 24, 32), (0.6, 8, 20, 10)):
        values[(x / radii[0]) ** 2 + (y / radii[1]) ** 2 + (z / radii[2]) ** 2 < 1] = value
    values += np.random.default_rng(5).normal(0.0, 0.02, values.shape)
    grid = pyopenvdb.FloatGrid(background=0.0)
    grid.copyFromArray((np.clip(np.rint(values * 255), 0, 255) / 255).astype(np.float32))
    grid.name, grid.gridClass = 'density', pyopenvdb.GridClass.FOG_VOLUME
    pyopenvdb.write(str(path), [grid])


VOLUMES = {
    'plume': ('`esvr-sample plume --resolution 112 --seed 77`', sample('plume', 112, 77)),
    'tree': ('`esvr-sample tree --resolution 208 --seed 77`', sample('tree', 208, 77)),
    'blobs': ('`esvr-sample blobs --resolution 88 --seed 77`', sample('blobs', 88, 77)),
    'hemibrain': ('`swc2vdb hemibrain_754538881.swc --resolution 300`',
                  skeleton('hemibrain_754538881', 300)),
    'gas_density': ('the grid `density` of `gas_0006`', grid_of('sequence', 'gas_0006', 'density')),
    'fire_temperature': ('the grid `temperature` of `fluid_data_0071`',
                         grid_of('fire', 'fluid_data_0071', 'temperature')),
    'scan': ('a synthetic scan with noise, 80 voxels long, 8 bits', scan),
    'sample_surface': ('`esvr-sample levelset --resolution 152 --seed 77`', sample('levelset', 152, 77)),
    'sphere': ('the level set of a sphere with a radius of 50 voxels', sphere),
    'torus': ('the level set of a torus with radii of 40 and 14 voxels', surface(torus, 116)),
    'gyroid': ('the level set of gyroid walls in a ball', surface(gyroid_ball, 100)),
}


def make(options, name, path):
    if not path.exists():
        VOLUMES[name][1](options, path)
