"""Arrays become volumes and come back; wrong arrays are refused; files of OpenVDB are read and written."""
import numpy as np
import pytest

import esvr


def test_an_array_comes_back(ball, volume):
    box = ((-3, 100, 7), (21, 124, 31))
    assert np.array_equal(volume.to_numpy(box), ball)
    assert volume.active_voxels == np.count_nonzero(ball)
    assert volume.background == 0.0 and volume.name == "density" and volume.grid_class == "fog volume"


def test_the_default_box_is_that_of_the_active_voxels(ball, volume):
    (x0, y0, z0), (x1, y1, z1) = volume.box
    inside = np.argwhere(ball > 0) + (-3, 100, 7)
    assert [x0, y0, z0] == inside.min(axis=0).tolist()
    assert [x1, y1, z1] == inside.max(axis=0).tolist()
    assert volume.to_numpy().shape == (x1 - x0 + 1, y1 - y0 + 1, z1 - z0 + 1)


def test_a_box_may_reach_beyond_the_voxels():
    volume = esvr.Volume.from_numpy(np.full((2, 3, 4), 5.0), background=2.0)
    array = volume.to_numpy(((-1, 0, 0), (2, 2, 3)))
    assert (array[0] == 2.0).all() and (array[1:3] == 5.0).all() and (array[3] == 2.0).all()


def test_arrays_of_other_types_and_orders_are_converted():
    array = np.arange(1, 25, dtype=np.int16).reshape(2, 3, 4)
    assert np.array_equal(esvr.Volume.from_numpy(array).to_numpy(), array)
    assert np.array_equal(esvr.Volume.from_numpy(np.asfortranarray(array)).to_numpy(), array)


def test_the_threshold_decides_which_voxels_are_active():
    array = np.array([[[0.0, 0.1, 0.2, 0.3]]])
    assert esvr.Volume.from_numpy(array, threshold=0.15).active_voxels == 2
    assert esvr.Volume.from_numpy(array, threshold=1.0).active_voxels == 0
    assert esvr.Volume.from_numpy(array, threshold=1.0).box is None


def test_the_transform_is_for_column_vectors(volume):
    assert np.array_equal(volume.transform @ [2, 4, 6, 1], [1, 2, 3, 1])


@pytest.mark.parametrize("arguments, text", [
    (dict(array=np.zeros((2, 2))), "2 axes"),
    (dict(array=np.zeros((0, 2, 2))), "no voxels"),
    (dict(array=np.zeros((1, 1, 1)), background=np.inf), "background"),
    (dict(array=np.zeros((1, 1, 1)), threshold=-1.0), "threshold"),
    (dict(array=np.zeros((1, 1, 1)), voxel_size=0.0), "voxel_size"),
    (dict(array=np.zeros((2, 1, 1)), origin=(2**31 - 1, 0, 0)), "index space"),
])
def test_wrong_arguments_are_refused(arguments, text):
    with pytest.raises(ValueError, match=text):
        esvr.Volume.from_numpy(**arguments)


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_voxel_that_is_not_finite_is_named(value):
    array = np.zeros((4, 4, 4))
    array[1, 2, 3] = value
    with pytest.raises(esvr.BadInput, match=r"\(11, 2, 3\)"):
        esvr.Volume.from_numpy(array, origin=(10, 0, 0))


def test_vdb_files_keep_the_volume(tmp_path, ball, volume):
    path = tmp_path / "ball.vdb"
    volume.save(path)
    back = esvr.Volume.from_vdb(path, "density")
    assert np.array_equal(back.to_numpy(((-3, 100, 7), (21, 124, 31))), ball)
    assert np.array_equal(back.transform, volume.transform)
    with pytest.raises(esvr.Error, match="exists"):
        volume.save(path)
    volume.save(path, overwrite=True)


def test_a_grid_that_is_missing_is_named(tmp_path, volume):
    path = tmp_path / "ball.vdb"
    volume.save(path)
    with pytest.raises(esvr.BadInput, match="temperature"):
        esvr.Volume.from_vdb(path, "temperature")


def test_real_files_are_read(data):
    volume = esvr.Volume.from_vdb(data / "aneurism.vdb")
    assert volume.active_voxels == 106773
    assert volume.to_numpy().max() == 1.0
