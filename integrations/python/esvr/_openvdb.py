"""Exchange with the grids of OpenVDB's own Python module, which is called openvdb since OpenVDB 12 and pyopenvdb
before.

A grid passes through a temporary .vdb file. The arrays of OpenVDB's module (copyToArray, copyFromArray) are dense, they
do not tell active voxels from others, and a grid would lose its metadata and the transform of a frustum.
"""
import importlib
import os
import tempfile

from ._core import UsageError, Volume

MODULES = ("openvdb", "pyopenvdb")
NUMBERS = ("float", "double")  # value types of OpenVDB


def openvdb():
    """OpenVDB's module."""
    for name in MODULES:
        try:
            module = importlib.import_module(name)
        except ModuleNotFoundError as missing:
            if missing.name != name:
                raise
        else:
            if hasattr(module, "FloatGrid"):  # otherwise it is a folder of this name, which Python takes for a package
                return module
    raise ImportError("OpenVDB's Python module is not installed (Debian and Ubuntu: python3-openvdb)")


def module_of(grid):
    """The module that a grid belongs to."""
    name = type(grid).__module__.partition(".")[0]
    if name not in MODULES:
        raise TypeError(f"a grid of {' or '.join(MODULES)} is needed, not {type(grid).__name__}")
    return importlib.import_module(name)


def volume_of(grid, *, nonfinite="refuse"):
    """Makes a volume of a FloatGrid of OpenVDB's Python module (pyopenvdb, openvdb since OpenVDB 12).

    Name, class, background, transform, metadata, active voxels and their values are those of the grid. Active tiles
    become voxels. Inactive voxels get the background. nonfinite is that of Volume.from_numpy.
    """
    module = module_of(grid)
    if grid.valueTypeName not in NUMBERS:
        raise UsageError(f"grid '{grid.name}' has values of type {grid.valueTypeName}; a volume has numbers")
    shared = grid.copy()  # with the same voxels, but metadata of its own
    shared.saveFloatAsHalf = False  # half floats would round the values
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "grid.vdb")
        module.write(path, grids=[shared])
        return Volume._from_only_grid(path, nonfinite)


def grid_of(self):
    """Makes a FloatGrid of OpenVDB's Python module (Debian and Ubuntu: python3-openvdb).

    Name, class, background, transform, metadata, active voxels and their values are those of the volume.
    """
    module = openvdb()
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "grid.vdb")
        self._save_as_float(path)
        grids, _ = module.readAll(path)
        return grids[0]
