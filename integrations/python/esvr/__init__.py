"""Sparse volumes as lists of ellipsoids.

    import esvr
    volume = esvr.Volume.from_vdb("smoke.vdb")
    grid = esvr.fit(volume, psnr=40)
    esvr.write("smoke.esvr", [grid])
    grid.render()                       # a picture as an array
    esvr.write("all.esvr", esvr.convert("smoke.vdb"))   # all grids, as vdb2esvr converts them

All coordinates are those of the index space: voxel (i, j, k) lies at (i, j, k), and arrays have the axes
x, y, z.
"""
from . import _core, _html, _openvdb, _xarray
from ._core import (BadInput, Cancelled, DeviceError, Ellipsoids, Error, File, Grid, GridBuilder,
                    MemoryExceeded, Metrics, PackedGrid, Sequence, TargetMissed, UsageError, Volume,
                     __version__, compare, convert, fit, frames, list_grids, read, read_splats, write,
                     write_splats, write_vdb)

__all__ = ["BadInput", "Cancelled", "DeviceError", "Ellipsoids", "Error", "File", "Grid", "GridBuilder",
           "MemoryExceeded", "Metrics", "PackedGrid", "Sequence", "TargetMissed", "UsageError", "Volume",
           "__version__", "compare", "convert", "fit", "frames", "list_grids", "read", "read_splats", "write",
           "write_splats", "write_vdb"]

Volume._repr_html_ = _html.of_volume
Grid._repr_html_ = _html.of_grid
Volume.from_pyopenvdb = staticmethod(_openvdb.volume_of)
Volume.to_pyopenvdb = _openvdb.grid_of
Volume.from_xarray = staticmethod(_xarray.volume_of)
Volume.to_xarray = _xarray.array_of
Volume.to_masked = _xarray.masked_of


def _restore(function, state):
    """What pickle calls to make an object again."""
    return getattr(_core, function)(state)
