"""Grids of OpenVDB's Python module become volumes and come back with all that OpenVDB knows of them."""
import sys

import numpy as np
import pytest

import esvr
from esvr import _openvdb

try:
    vdb = _openvdb.openvdb()
except ImportError:
    pytest.skip("OpenVDB's Python module is missing (Debian: python3-openvdb)", allow_module_level=True)


def fog(transform=None):
    """A grid with two active voxels, one of which has the value of the background, and an active tile."""
    grid = vdb.FloatGrid(0.25)
    grid.name = "Rauch, böser"
    grid.gridClass = vdb.GridClass.FOG_VOLUME
    grid.transform = transform or vdb.createLinearTransform(0.5)
    grid["source"] = "a test"
    accessor = grid.getAccessor()
    accessor.setValueOn((-3, 100, 7), 1.1)
    accessor.setValueOn((5, 100, 7), 0.25)
    accessor.setValueOff((6, 100, 7), 9.0)
    grid.fill((16, 16, 16), (23, 23, 23), 3.0, active=True)
    return grid


def active_voxels(grid):
    """All active voxels and their values."""
    values = {}
    for item in grid.citerOnValues():
        low, high = np.array(item.min), np.array(item.max)
        for voxel in np.argwhere(np.ones(high - low + 1)) + low:
            values[tuple(voxel)] = item.value
    return values


def matrix(transform):
    """The rows of the affine map, from the images of the origin and of the axes."""
    return [transform.indexToWorld(point) for point in ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1))]


def test_a_grid_becomes_a_volume():
    grid = fog()
    volume = esvr.Volume.from_pyopenvdb(grid)
    assert (volume.name, volume.grid_class, volume.background) == ("Rauch, böser", "fog volume", 0.25)
    assert volume.active_voxels == grid.activeVoxelCount() == 2 + 8**3
    assert volume.box == [[-3, 16, 7], [23, 100, 23]]
    assert np.array_equal(volume.to_numpy(((-3, 100, 7), (-2, 100, 7))).ravel(), np.float32([1.1, 0.25]))
    assert np.array_equal(volume.transform, np.diag([0.5, 0.5, 0.5, 1]))


def test_a_grid_comes_back_with_everything():
    grid = fog(vdb.createLinearTransform([[1, 2, 0, 0], [0, 3, 0, 0], [0, 0, 4, 0], [5, 6, 7, 1]]))
    back = esvr.Volume.from_pyopenvdb(grid).to_pyopenvdb()
    assert type(back) is type(grid)
    assert (back.name, back.gridClass, back.background) == (grid.name, grid.gridClass, grid.background)
    assert active_voxels(back) == active_voxels(grid)
    assert matrix(back.transform) == matrix(grid.transform)
    assert back["source"] == "a test"


def test_a_level_set_comes_back_with_its_signs():
    grid = vdb.createLevelSetSphere(radius=6.0, voxelSize=0.5)
    grid.name = "sphere"
    back = esvr.Volume.from_pyopenvdb(grid).to_pyopenvdb()
    assert back.gridClass == vdb.GridClass.LEVEL_SET and back.background == grid.background
    assert active_voxels(back) == active_voxels(grid)
    assert back.getConstAccessor().getValue((0, 0, 0)) == -grid.background


def test_a_frustum_comes_back():
    transform = vdb.createFrustumTransform((0, 0, 0), (99, 99, 49), taper=0.5, depth=2.0, voxelSize=0.1)
    volume = esvr.Volume.from_pyopenvdb(fog(transform))
    assert volume.transform is None
    assert matrix(volume.to_pyopenvdb().transform) == matrix(transform)


def test_an_array_of_xarray_does_not_lose_a_frustum_without_a_word():
    pytest.importorskip("xarray")
    transform = vdb.createFrustumTransform((0, 0, 0), (99, 99, 49), taper=0.5, depth=2.0, voxelSize=0.1)
    volume = esvr.Volume.from_pyopenvdb(fog(transform))
    with pytest.warns(UserWarning, match="is a frustum") as told:
        array = volume.to_xarray()
    assert told[0].filename == __file__
    with pytest.raises(esvr.UsageError, match="indices of voxels"):
        esvr.Volume.from_xarray(array)


def test_warnings_name_the_line_of_the_caller():
    transform = vdb.createFrustumTransform((0, 0, 0), (99, 99, 49), taper=0.5, depth=2.0, voxelSize=0.1)
    grid = fog(transform)
    grid.getAccessor().setValueOff((1, 2, 4), 7.0)
    volume = esvr.Volume.from_pyopenvdb(grid)
    with pytest.warns(UserWarning, match="is a frustum") as told:
        volume.render(4, 4)
    with pytest.warns(UserWarning, match="loses") as told_of_values:
        esvr.fit(volume, lossless=True, device="cpu")
    assert told[0].filename == told_of_values[0].filename == __file__


def test_values_are_not_rounded_to_half_floats():
    grid = fog()
    grid.saveFloatAsHalf = True
    assert active_voxels(esvr.Volume.from_pyopenvdb(grid).to_pyopenvdb()) == active_voxels(grid)
    assert grid.saveFloatAsHalf  # the grid of the caller is not changed


@pytest.mark.parametrize("name", ["", "density[1]", "a/b"])
def test_any_name_is_kept(name):
    grid = fog()
    grid.name = name
    volume = esvr.Volume.from_pyopenvdb(grid)
    assert volume.name == name and volume.to_pyopenvdb().name == name


def test_a_grid_without_active_voxels_comes_back():
    volume = esvr.Volume.from_pyopenvdb(vdb.FloatGrid(2.0))
    assert volume.box is None and volume.background == 2.0
    assert volume.to_pyopenvdb().empty()


def test_arrays_become_grids(ball, volume):
    array = np.zeros_like(ball)
    grid = volume.to_pyopenvdb()
    grid.copyToArray(array, ijk=(-3, 100, 7))
    assert np.array_equal(array, ball) and grid.transform.voxelSize() == (0.5, 0.5, 0.5)


def test_what_is_no_grid_of_numbers_is_refused():
    with pytest.raises(esvr.UsageError, match="'mask'.*bool"):
        grid = vdb.BoolGrid()
        grid.name = "mask"
        esvr.Volume.from_pyopenvdb(grid)
    with pytest.raises(TypeError, match="ndarray"):
        esvr.Volume.from_pyopenvdb(np.zeros((2, 2, 2)))


def test_a_voxel_that_is_not_finite_is_named():
    grid = fog()
    grid.getAccessor().setValueOn((1, 2, 3), float("nan"))
    with pytest.raises(esvr.BadInput, match=r"\(1, 2, 3\)"):
        esvr.Volume.from_pyopenvdb(grid)


def test_a_folder_with_the_name_of_the_module_is_passed_over(volume, tmp_path, monkeypatch):
    (tmp_path / "openvdb").mkdir()
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "openvdb", raising=False)
    assert volume.to_pyopenvdb().name == "density"
