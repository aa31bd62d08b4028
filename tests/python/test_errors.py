"""What calls with wrong arguments say."""
import numpy as np
import pytest

import esvr

ONES = np.ones((2, 2, 2))


@pytest.mark.parametrize("call, text", [
    (lambda v: esvr.fit(v, psrn=4), "esvr.fit() has no argument psrn; did you mean psnr?"),
    (lambda v: esvr.convert([v], max_eror=4), "esvr.convert() has no argument max_eror; did you mean max_error?"),
    (lambda v: esvr.write("a.esvr", [], overwrit=True), "esvr.write() has no argument overwrit; did you mean overwrite?"),
    (lambda v: esvr.Volume.from_numpy(ONES, voxelsize=2), "Volume.from_numpy() has no argument voxelsize; did you mean voxel_size?"),
    (lambda v: esvr.Volume.from_xarray(v, nonfinit="keep"),
     "Volume.from_xarray() has no argument nonfinit; did you mean nonfinite?"),
    (lambda v: v.to_xarray(mask=True), "Volume.to_xarray() has no argument mask; did you mean masked?"),
    (lambda v: v.render(colour="magma"), "Volume.render() has no argument colour; did you mean colors?"),
    (lambda v: esvr.GridBuilder("float", nam="a"), "GridBuilder() has no argument nam; did you mean name?"),
    (lambda v: esvr.Sequence("a.esvr", limit=3), "Sequence() has no argument limit; it has: path, max_memory")])
def test_a_misspelt_argument_is_named(volume, call, text):
    with pytest.raises(TypeError) as raised:
        call(volume)
    assert str(raised.value) == text


def test_other_errors_are_those_of_the_function(volume):
    with pytest.raises(TypeError, match="incompatible function arguments"):
        esvr.fit(3, psnr=40)
    with pytest.raises(ZeroDivisionError):
        esvr.fit(volume, count=40, preset="draft", device="cpu", progress=lambda share: 1 / 0)


@pytest.mark.parametrize("call", [
    lambda: esvr.Volume.from_numpy([[1], [1, 2]]),
    lambda: esvr.Volume.from_numpy(ONES, metadata={1: 2}),
    lambda: esvr.Volume.from_numpy(ONES, metadata={"a": 2**70}),
    lambda: esvr.Volume.from_numpy(ONES, metadata={"a": (2**40, 1, 1)}),
    lambda: esvr.Volume.from_numpy(ONES, metadata={"a": "\ud800"}),
    lambda: esvr.GridBuilder("float", background="x"),
    lambda: esvr.GridBuilder("int32", background=None),
    lambda: esvr.Volume.from_numpy(ONES).to_numpy(((0, 0, 0), (2**30, 2**30, 2**30))),
    lambda: esvr.GridBuilder().finish().to_numpy(((0, 0, 0), (2**30, 2**30, 2**30)))])
def test_wrong_values_are_errors_of_the_module(call):
    with pytest.raises(esvr.Error):
        call()


def test_coarsen_is_that_of_esvr2vdb(grid, tmp_path):
    file = esvr.convert([grid.to_volume()], lossless=True, device="cpu")
    for wrong in (1, 3, 16, True, 2.0, "2", "", 0, -2):
        for call in (grid.to_volume, lambda coarsen: file.save(tmp_path / "a.vdb", coarsen=coarsen)):
            with pytest.raises(esvr.UsageError, match=r"coarsen is 2, 4, 8 or 'auto', not "):
                call(coarsen=wrong)
    with pytest.raises(esvr.UsageError, match="exclude"):
        grid.to_volume(coarsen="auto", voxel_size=1.0)
    size = grid.to_volume().transform[0, 0]
    for factor in (2, np.int64(4), 8):
        assert grid.to_volume(coarsen=factor).transform[0, 0] == factor * size


@pytest.mark.parametrize("goal", [{"lossless": True}, {"count": 60, "representation": "ellipsoids", "preset": "draft"}])
def test_coarsen_auto_keeps_to_the_memory(goal):
    """The factor rises while the memory shrinks, until the coarsest grid is refused."""
    x, y, z = np.mgrid[-1:1:96j, -1:1:96j, -1:1:96j]
    grid = esvr.fit(esvr.Volume.from_numpy(np.exp(-4 * (x * x + y * y + z * z)), threshold=0.05), device="cpu", **goal)
    factors = []
    for memory in np.geomspace(30e6, 1e5, 100):
        try:
            factors.append(int(grid.to_volume(coarsen="auto", max_memory=int(memory)).transform[0, 0]))
        except esvr.MemoryExceeded:
            factors.append(99)
        else:
            if factors[-1] > 1:
                with pytest.raises(esvr.MemoryExceeded):
                    grid.to_volume(coarsen=factors[-1] // 2 if factors[-1] > 2 else None, max_memory=int(memory))
    assert factors == sorted(factors) and factors[0] == 1 and {2, 99} <= set(factors), factors


def test_auto_keeps_what_fits_as_it_is(tmp_path, volume):
    labels = esvr.GridBuilder("int32", name="labels")
    labels.add(np.ones((8, 8, 8), np.int32))
    esvr.write_vdb(tmp_path / "a.vdb", [labels.finish()])
    volume.save(tmp_path / "b.vdb")
    file = esvr.convert(tmp_path / "a.vdb", device="cpu")
    assert file.save(tmp_path / "c.vdb", coarsen="auto") == [] and esvr.list_grids(tmp_path / "c.vdb") == [("labels", "int32")]
    esvr.convert([volume], lossless=True, device="cpu").save(tmp_path / "d.vdb", coarsen="auto")
    assert np.array_equal(esvr.Volume.from_vdb(tmp_path / "d.vdb").to_numpy(), volume.to_numpy())
