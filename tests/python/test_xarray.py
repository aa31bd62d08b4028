"""Volumes become arrays of xarray and masked arrays of NumPy, and come back."""
import os
import pathlib
import subprocess
import sys

import numpy as np
import pytest

import esvr

xarray = pytest.importorskip("xarray")


def field(dims=("z", "y", "x"), **coordinates):
    values = np.arange(1.0, 25.0, dtype=np.float32).reshape(2, 3, 4)
    return xarray.DataArray(values, dims=dims, name="t", attrs={"units": "K"}, coords=coordinates)


def test_axes_are_found_by_their_names():
    volume = esvr.Volume.from_xarray(field())
    assert np.array_equal(volume.to_numpy(((0, 0, 0), (3, 2, 1))), field().values.transpose(2, 1, 0))
    assert volume.name == "t" and volume.metadata == {"value_unit": "K"}
    same = esvr.Volume.from_xarray(field(("level", "latitude", "longitude")))
    assert np.array_equal(same.to_numpy(), volume.to_numpy())
    assert np.array_equal(esvr.Volume.from_xarray(field(("i", "j", "k"))).to_numpy(), volume.to_numpy()), "the last one is x"


def test_coordinates_become_the_transform():
    array = field(z=("z", [10.0, 20.0], {"units": "km"}), y=("y", [3.0, 2.0, 1.0], {"units": "m"}),
                  x=("x", [0.0, 0.5, 1.0, 1.5], {"units": "m"}))
    volume = esvr.Volume.from_xarray(array)
    assert np.allclose(volume.transform, [[0.5, 0, 0, 0], [0, 1, 0, 1], [0, 0, 10000, 10000], [0, 0, 0, 1]])
    assert volume.metadata["length_unit"] == "m"
    assert volume.to_numpy()[0, 0, 0] == array.values[0, 2, 0], "the falling axis is turned round"
    back = volume.to_xarray()
    assert back.dims == ("x", "y", "z") and back.attrs["units"] == "K" and back.x.attrs["units"] == "m"
    assert back.sel(x=0.5, y=3.0, z=20000.0) == array.sel(x=0.5, y=3.0, z=20.0)


def test_uneven_coordinates_count_voxels():
    with pytest.warns(UserWarning, match="steps of the axis x"):
        volume = esvr.Volume.from_xarray(field(x=[0.0, 1.0, 2.0, 4.0]))
    assert np.array_equal(volume.transform, np.eye(4))


def test_missing_elements_are_inactive_and_come_back():
    array = field()
    array.values[0, 1, 2] = np.nan
    array.values[1, 0, 0] = 0.0
    volume = esvr.Volume.from_xarray(array)
    assert volume.active_voxels == 23, "the value of the background is active where it is not missing"
    back = volume.to_xarray()
    assert np.array_equal(back.values.transpose(2, 1, 0), array.values, equal_nan=True)
    assert volume.to_xarray(masked=False).values[2, 1, 0] == 0.0
    assert esvr.Volume.from_xarray(array, threshold=0.0).active_voxels == 22
    assert again_of(volume.to_masked()).active_voxels == 23


def again_of(masked):
    return esvr.Volume.from_numpy(masked, active=~masked.mask)


def test_masked_arrays_come_back():
    array = np.ma.masked_greater(np.arange(24.0).reshape(2, 3, 4), 20)
    volume = esvr.Volume.from_numpy(array, active=np.ones(array.shape, bool), background=7)
    back = volume.to_masked(((0, 0, 0), (1, 2, 3)))
    assert np.array_equal(back.mask, array.mask) and np.array_equal(back.compressed(), array.compressed())
    assert back.fill_value == 7 and back.filled()[1, 2, 3] == 7


def test_a_turned_grid_has_indices_as_coordinates():
    turn = [[0, -1, 0, 5], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
    array = esvr.Volume.from_numpy(np.ones((2, 2, 2)), transform=turn, origin=(4, 0, 0)).to_xarray()
    assert array.x.values.tolist() == [4, 5] and np.array_equal(np.reshape(array.attrs["transform"], (4, 4)), turn)


@pytest.mark.parametrize("array, words", [
    (xarray.DataArray(np.zeros((2, 2))), "three axes of space"),
    (xarray.DataArray(np.zeros((2, 2, 2)), dims=("time", "y", "x")), "time \\(time\\)"),
    (xarray.DataArray(np.zeros((2, 2, 2)), dims=("x", "lon", "y")), "three axes of space"),
    (xarray.DataArray(np.zeros((2, 2, 2)), dims=("z", "y", "x"), coords={"x": ["a", "b"]}), "no numbers")])
def test_other_arrays_are_refused(array, words):
    with pytest.raises(esvr.UsageError, match=words):
        esvr.Volume.from_xarray(array)


def test_nothing_of_this_is_loaded_before_it_is_needed():
    """To load NumPy and xarray takes longer than to load the module."""
    package = pathlib.Path(esvr.__file__).parent.parent
    code = "import esvr, sys; print({'numpy', 'xarray', 'esvr.images'} & set(sys.modules))"
    run = subprocess.run([sys.executable, "-c", code], env={**os.environ, "PYTHONPATH": str(package)}, text=True, capture_output=True)
    assert run.stdout == "set()\n", run.stdout + run.stderr


def test_wrong_options_of_arrays_are_refused():
    ones = np.ones((2, 2, 2))
    for wrong in ({"active": np.ones((2, 2), bool)}, {"voxel_size": 1.0, "transform": np.eye(4)}, {"transform": np.zeros((4, 4))},
                  {"level_set": True, "grid_class": "unknown"}, {"grid_class": "cloud"}, {"metadata": {"a": [1]}}):
        with pytest.raises(esvr.UsageError):
            esvr.Volume.from_numpy(ones, **wrong)
