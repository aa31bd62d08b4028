"""Arrays become volumes and come back; wrong arrays are refused; files of OpenVDB are read and written. NaN and
infinite voxels are refused by default, and kept where they were with nonfinite='keep'."""
import sys

import numpy as np
import pytest

import esvr
from esvr import _openvdb


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


@pytest.mark.parametrize("dtype", [float, int, np.float32])
def test_masked_elements_are_inactive(dtype):
    array = np.ma.masked_equal(np.array([[[1, 2, 999, 4]]], dtype=dtype), 999)
    volume = esvr.Volume.from_numpy(array)
    assert volume.active_voxels == 3
    assert volume.to_numpy(((0, 0, 0), (0, 0, 3))).tolist() == [[[1, 2, 0, 4]]]
    assert esvr.Volume.from_numpy(np.ma.array([[[1.0]]])).active_voxels == 1, "without a mask"


@pytest.mark.parametrize("hidden", [np.nan, 1e300])
def test_what_a_mask_hides_does_not_matter(hidden):
    array = np.ma.array([[[1.0, hidden]]], mask=[[[False, True]]])
    assert esvr.Volume.from_numpy(array).active_voxels == 1


@pytest.mark.parametrize("dtype, value", [
    (np.int32, 2**24 + 1), (np.uint32, 2**32 - 1), (np.int64, -2**24 - 1), (np.int64, 2**63 - 1),
    (np.uint64, 2**64 - 1), (np.int64, 2**62 + 1)])
def test_integers_that_would_change_are_refused(dtype, value):
    array = np.array([[[1, value]]], dtype=dtype)
    with pytest.raises(ValueError, match=r"\(5, 0, 1\) is no float32"):
        esvr.Volume.from_numpy(array, origin=(5, 0, 0))
    masked = np.ma.array(array, mask=[[[False, True]]])
    assert esvr.Volume.from_numpy(masked).active_voxels == 1


@pytest.mark.parametrize("dtype, value", [
    (np.int32, 2**24 + 2), (np.int32, -2**31), (np.int64, 2**62), (np.int64, -2**63), (np.uint64, 2**63),
    (bool, True), (np.float16, 0.5)])
def test_numbers_that_float32_has_are_kept(dtype, value):
    volume = esvr.Volume.from_numpy(np.array([[[value]]], dtype=dtype))
    assert volume.to_numpy()[0, 0, 0] == np.float64(value) and volume.rounded_values == 0


def test_rounded_doubles_are_counted():
    volume = esvr.Volume.from_numpy(np.array([[[0.5, 0.1, 0.2, 1e-60]]]), threshold=0.15)
    assert volume.active_voxels == 2 and volume.rounded_values == 1
    assert esvr.Volume.from_numpy(np.full((9, 9, 9), 1 / 3)).rounded_values == 729


def test_rounded_doubles_of_a_file_are_counted(tmp_path):
    builder = esvr.GridBuilder("double")
    builder.add(np.array([[[0.5, 0.1, 0.2, 1e-60]]]))
    esvr.write_vdb(tmp_path / "a.vdb", [builder.finish()])
    assert esvr.Volume.from_vdb(tmp_path / "a.vdb").rounded_values == 3


@pytest.mark.parametrize("array, text", [
    (np.array([[["2020-01-01"]]], dtype="datetime64[D]"), "datetime64"),
    (np.zeros((1, 1, 1), dtype="timedelta64[s]"), "timedelta64"),
    (np.zeros((1, 1, 1), dtype=[("a", float), ("b", float)]), "'a'"),
    (np.array([[["7"]]]), "<U1"),
    (np.array([[[1, None]]], dtype=object), "object"),
    (np.array([[[1 + 2j]]]), "complex"),
    (np.array([[[1e39]]]), r"\(0, 0, 0\) is beyond"),
])
def test_arrays_that_are_no_numbers_are_refused(array, text):
    with pytest.raises(ValueError, match=text):
        esvr.Volume.from_numpy(array)


@pytest.mark.parametrize("last", [2**31 - 1, -2**31])
@pytest.mark.parametrize("side", [1, 9])
def test_voxels_at_the_ends_of_the_index_space_are_kept(tmp_path, last, side):
    corner = last - side + 1 if last > 0 else last
    volume = esvr.Volume.from_numpy(np.ones((side, side, side)), origin=(corner,) * 3)
    assert volume.active_voxels == side**3
    assert volume.box == [[corner] * 3, [corner + side - 1] * 3]
    volume.save(tmp_path / "a.vdb")
    assert esvr.Volume.from_vdb(tmp_path / "a.vdb").box == volume.box


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


def test_without_openvdb_the_package_is_named(volume, monkeypatch):
    for name in _openvdb.MODULES:
        monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(ImportError, match="python3-openvdb"):
        volume.to_pyopenvdb()


def test_real_files_are_read(data):
    volume = esvr.Volume.from_vdb(data / "aneurism.vdb")
    assert volume.active_voxels == 106773
    assert volume.to_numpy().max() == 1.0


@pytest.fixture(scope="module")
def holes(ball):
    """The ball with NaN, an infinity and a minus infinity."""
    values = ball.copy()
    values[10:13, 11, 12] = np.nan
    values[12, 12, 12], values[0, 0, 0] = np.inf, -np.inf
    return values


@pytest.fixture(scope="module")
def volume_with_holes(holes):
    return esvr.Volume.from_numpy(holes, nonfinite="keep")


BOX = ((0, 0, 0), (24, 24, 24))


def test_a_volume_has_them_as_they_are(holes, volume_with_holes):
    np.testing.assert_array_equal(volume_with_holes.to_numpy(BOX), holes)
    assert volume_with_holes.nonfinite == 5
    assert volume_with_holes.value_range == (np.nanmin(holes[holes > 0]), holes[np.isfinite(holes)].max())


@pytest.mark.parametrize("goal", [dict(max_error=0.01), dict(lossless=True), dict(psnr=30.0, representation="ellipsoids"),
                                  dict(max_relative_error=0.05), {}])
def test_a_file_gives_them_back(goal, holes, volume_with_holes, tmp_path):
    volume_with_holes.save(tmp_path / "in.vdb")
    with pytest.raises(esvr.BadInput, match="nonfinite='keep'"):
        esvr.convert(tmp_path / "in.vdb")
    file = esvr.convert(tmp_path / "in.vdb", nonfinite="keep", device="cpu", **goal)
    esvr.write(tmp_path / "out.esvr", file)
    grid = esvr.read(tmp_path / "out.esvr")["density"]
    assert grid.nonfinite == 5
    back = grid.to_volume().to_numpy(BOX)
    finite = np.isfinite(holes)
    np.testing.assert_array_equal(back[~finite], holes[~finite])
    assert np.isfinite(back[finite]).all()
    metrics = esvr.compare(volume_with_holes, grid)
    assert metrics.max_error <= np.abs(back[finite] - holes[finite]).max() * 1.000001
    if "max_error" in goal:
        assert metrics.max_error <= goal["max_error"]
    again = esvr.Volume.from_vdb(tmp_path / "in.vdb", nonfinite="keep")
    assert again.nonfinite == 5


def test_volumes_are_refused_unless_they_are_kept(volume_with_holes):
    for call in (lambda: esvr.convert([volume_with_holes]), lambda: esvr.fit(volume_with_holes, max_error=0.1)):
        with pytest.raises(esvr.BadInput, match="'density' has voxels that are not finite; nonfinite='keep'"):
            call()
    assert esvr.fit(volume_with_holes, max_error=0.1, nonfinite="keep").nonfinite == 5


def test_other_words_are_refused(ball, volume):
    with pytest.raises(esvr.UsageError, match="refuse, keep"):
        esvr.Volume.from_numpy(ball, nonfinite="zero")
    with pytest.raises(esvr.UsageError, match="refuse, keep"):
        esvr.fit(volume, max_error=0.1, nonfinite="drop")


def test_a_picture_shows_them_as_empty(holes, volume_with_holes):
    empty = esvr.Volume.from_numpy(np.where(np.isfinite(holes), holes, 0.0))
    view = dict(eye=(40, 30, 20), center=(12, 12, 12), range=(0, 1), device="cpu")
    expected = empty.render(24, 24, **view)
    np.testing.assert_array_equal(volume_with_holes.render(24, 24, **view), expected)
    grid = esvr.fit(volume_with_holes, lossless=True, nonfinite="keep")
    np.testing.assert_array_equal(grid.render(24, 24, **view), expected)
