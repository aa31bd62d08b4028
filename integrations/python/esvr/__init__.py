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
from . import _core, _html, _keywords, _openvdb, _xarray


def _restore(function, state):
    """What pickle calls to make an object again."""
    return getattr(_core, function)(state)


def _token(thing):
    """What Dask takes for the content of an object: equal ones have the same token, in every process."""
    import hashlib
    import pickle
    voxels = []
    digest = hashlib.sha256(pickle.dumps(thing, protocol=5, buffer_callback=voxels.append))
    for part in voxels:
        digest.update(part.raw())
    return digest.hexdigest()


def _add(target, **methods):
    """Adds methods that are written in Python to a class of _core."""
    for name, method in methods.items():
        setattr(target, name, method)


_add(_core.Volume, _repr_html_=_html.of_volume, from_pyopenvdb=staticmethod(_openvdb.volume_of), to_pyopenvdb=_openvdb.grid_of,
     from_xarray=staticmethod(_xarray.volume_of), to_xarray=_xarray.array_of, to_masked=_xarray.masked_of)
_add(_core.Grid, _repr_html_=_html.of_grid)
for _class in (_core.Volume, _core.Grid, _core.File, _core.PackedGrid, _core.Ellipsoids, _core.Metrics):
    _add(_class, __dask_tokenize__=_token)
_keywords.explain_all()  # before the names below are those of its functions

from ._core import (BadInput, Cancelled, DeviceError, Ellipsoids, Error, File, Grid, GridBuilder,
                    MemoryExceeded, Metrics, PackedGrid, Sequence, TargetMissed, UsageError, Volume,
                     __version__, compare, convert, fit, frames, list_grids, read, read_splats, write,
                     write_splats, write_vdb)

__all__ = ["BadInput", "Cancelled", "DeviceError", "Ellipsoids", "Error", "File", "Grid", "GridBuilder",
           "MemoryExceeded", "Metrics", "PackedGrid", "Sequence", "TargetMissed", "UsageError", "Volume",
           "__version__", "compare", "convert", "fit", "frames", "list_grids", "read", "read_splats", "write",
           "write_splats", "write_vdb"]
