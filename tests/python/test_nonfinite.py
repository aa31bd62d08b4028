"""NaN and infinite voxels: refused by default, and kept where they were with nonfinite='keep'."""
import numpy as np
import pytest

import esvr


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
