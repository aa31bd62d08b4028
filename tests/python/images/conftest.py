"""The modules of other tools, and where the small files lie on which earlier readers failed."""
import os
import pathlib

import pytest


def module(name):
    """A fixture with a module; tests that need it are skipped without it."""
    return pytest.fixture(lambda: pytest.importorskip(name))


gdal, h5py, mrcfile, nibabel = map(module, ("osgeo.gdal", "h5py", "mrcfile", "nibabel"))
netcdf, pydicom, tifffile, xarray, zarr = map(module, ("netCDF4", "pydicom", "tifffile", "xarray", "zarr"))


@pytest.fixture
def edge():
    """The folder of small files on which earlier readers failed."""
    folder = pathlib.Path(os.environ.get("ESVR_DATA_DIR", "/nowhere")) / "edge/faults2"
    if not folder.is_dir():
        pytest.skip("ESVR_DATA_DIR has no folder edge/faults2")
    return folder
