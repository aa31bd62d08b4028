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
    with pytest.warns(UserWarning, match="steps of the axis x") as told:
        volume = esvr.Volume.from_xarray(field(x=[0.0, 1.0, 2.0, 4.0]))
    assert told[0].filename == __file__, "the line of the caller is named"
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


def same_place(a, b):
    """Volumes with the same voxels at the same places in the world, by the same indices."""
    assert a.box == b.box and np.allclose(a.transform, b.transform, rtol=1e-12, atol=1e-12)
    assert np.array_equal(a.to_numpy(), b.to_numpy()) and np.array_equal(a.active(), b.active())


TURNED = [[0, -0.1, 0, 5], [0.1, 0, 0, -3], [0, 0, 0.1, 0.25], [0, 0, 0, 1]]
SHEARED = [[0.1, 0.05, 0, 0], [0, 0.1, 0, 0], [0, 0, 0.3, 7], [0, 0, 0, 1]]
MIRRORED = [[-0.1, 0, 0, 4e6], [0, 0.1, 0, 0.03], [0, 0, 2, -1], [0, 0, 0, 1]]


@pytest.mark.parametrize("transform", [TURNED, SHEARED, MIRRORED, np.diag([0.1, 0.2, 0.3, 1.0])])
@pytest.mark.parametrize("shape", [(2, 3, 4), (1, 1, 5)])
def test_every_transform_comes_back(transform, shape):
    values = np.arange(1.0, 1 + np.prod(shape)).reshape(shape)
    volume = esvr.Volume.from_numpy(values, transform=transform, origin=(-7, 3, 40), metadata={"length_unit": "mm"})
    array = volume.to_xarray()
    again = esvr.Volume.from_xarray(array)
    same_place(again, volume)
    assert again.metadata == {"length_unit": "mm"}
    same_place(esvr.Volume.from_xarray(array.transpose("z", "x", "y").isel(y=slice(None, None, -1))), volume)
    single = array.assign_coords({axis: (axis, array[axis].values.astype("f4"), array[axis].attrs) for axis in "yz"})
    same_place(esvr.Volume.from_xarray(single), volume)


def test_results_of_operations_keep_their_place():
    """Those that drop the attributes of an array keep those of its coordinates."""
    volume = esvr.Volume.from_numpy(np.ones((1, 2, 3)), transform=np.diag([0.1, 0.2, 0.3, 1.0]), origin=(-7, 3, 40))
    sums = 2 * volume.to_xarray()
    assert "transform" not in sums.attrs
    assert np.allclose(esvr.Volume.from_xarray(sums).transform,
                       [[0.1, 0, 0, -0.7], [0, 0.2, 0, 0.6], [0, 0, 0.3, 12], [0, 0, 0, 1]])


@pytest.mark.parametrize("transform", [TURNED, MIRRORED, np.diag([0.1, 0.2, 0.3, 1.0])])
def test_parts_and_averages_stay_in_their_place(transform):
    volume = esvr.Volume.from_numpy(np.arange(1.0, 65.0).reshape(4, 4, 4), transform=transform, origin=(8, 0, 0))
    array, place = volume.to_xarray(), np.array(transform) @ [10, 1, 3, 1]
    part = esvr.Volume.from_xarray(array.isel(x=slice(2, None), y=slice(1, None, 2), z=slice(1, None, 2)))
    assert part.to_numpy()[0, 0, 1] == array.values[2, 1, 3]
    assert np.allclose(part.transform @ [*(np.array(part.box[0]) + (0, 0, 1)), 1], place)
    averages = array.coarsen(x=2, y=2, z=2).mean(keep_attrs=True)
    coarse = esvr.Volume.from_xarray(averages)
    assert np.allclose(coarse.transform @ [1, 0, 0, 1], np.array(transform) @ [10.5, 0.5, 0.5, 1])


def test_contradictions_are_refused():
    def refused(array, words):
        with pytest.raises(esvr.UsageError, match=words):
            esvr.Volume.from_xarray(array)
    ones = np.ones((3, 3, 3))
    plain = esvr.Volume.from_numpy(ones, voxel_size=0.1).to_xarray()
    turned = esvr.Volume.from_numpy(ones, transform=TURNED).to_xarray()
    refused(plain.assign_attrs(transform=np.diag([7.0, 7, 7, 1]).ravel()), "dimension x contradict.*step is 0.1.*voxels 7")
    refused(plain.assign_attrs(transform=np.diag([0.05, 0.1, 0.1, 1]).ravel()), "dimension x contradict.*step is 0.1.*voxels 0.05")
    refused(plain.assign_coords(y=plain.y * 1.5), "dimension y contradict")
    refused(plain.assign_coords(y=plain.y * 2), "dimension y contradict")
    refused(turned.assign_coords(y=turned.y * 2), "dimension y contradict")
    refused(plain.assign_coords(z=plain.z + 0.03), "dimension z contradict.*begin at 0.03")
    refused(plain.assign_coords(z=[0.0, 0.1, 0.3]), "dimension z contradict.*steps of the axis z differ")
    refused(turned.assign_coords(x=turned.x * 0.1), "dimension x contradict")
    refused(turned.assign_coords(x=("x", turned.x.values, {"units": "m"})), "dimension x contradict.*are in m")
    for wrong in ("north", [1.0, 2.0], np.full(16, np.nan)):
        refused(turned.assign_attrs(transform=wrong), "16 numbers")
    refused(turned.assign_attrs(transform=np.zeros(16)), "singular|invert")
    refused(turned.drop_attrs() if hasattr(turned, "drop_attrs") else 2 * turned, "indices of voxels.*keep_attrs")
    assert np.array_equal(esvr.Volume.from_xarray((2 * turned).drop_vars(["x", "y", "z"])).transform, np.eye(4))


def test_infinities_are_kept_where_they_are_wanted():
    array = field()
    array.values[0, 1, 2], array.values[1, 0, 0] = np.inf, np.nan
    with pytest.raises(esvr.BadInput, match="nonfinite='keep'"):
        esvr.Volume.from_xarray(array)
    volume = esvr.Volume.from_xarray(array, nonfinite="keep")
    assert volume.nonfinite == 1 and volume.active_voxels == 23 and volume.to_numpy()[2, 1, 0] == np.inf
    assert esvr.Volume.from_xarray(volume.to_xarray(), nonfinite="keep").nonfinite == 1


def test_what_is_no_array_of_xarray_is_refused():
    with pytest.raises(TypeError, match="not numpy.ndarray; Volume.from_numpy takes"):
        esvr.Volume.from_xarray(np.ones((2, 2, 2)))
    with pytest.raises(TypeError, match="Dataset: take one of its arrays"):
        esvr.Volume.from_xarray(field().to_dataset())
    with pytest.raises(esvr.UsageError, match="no elements \\(z: 0, y: 3, x: 4\\)"):
        esvr.Volume.from_xarray(field().isel(z=slice(0, 0)))


@pytest.mark.parametrize("array, words", [
    (xarray.DataArray(np.zeros((2, 2))), "three axes of space"),
    (xarray.DataArray(np.zeros((2, 2, 2)), dims=("time", "y", "x")), "time means time"),
    (xarray.DataArray(np.zeros((2, 2, 2)), dims=("a", "b", "c")), "dimensions a, b, c .*: c means channel"),
    (xarray.DataArray(np.zeros((2, 2, 2)), dims=("x", "lon", "y")), "x and lon both mean x"),
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
