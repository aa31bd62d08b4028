"""Objects are pickled and copied, within this process and by others, and say what they are."""
import copy
import multiprocessing
import pickle

import numpy as np
import pytest

import esvr


def again(thing):
    return pickle.loads(pickle.dumps(thing, protocol=pickle.HIGHEST_PROTOCOL))


def same_volumes(a, b):
    assert (a.name, a.grid_class, a.background, a.box, a.metadata) == (b.name, b.grid_class, b.background, b.box, b.metadata)
    assert np.array_equal(a.transform, b.transform)
    if a.box:
        assert a.to_numpy().tobytes() == b.to_numpy().tobytes()
        assert np.array_equal(a.active(), b.active())


def test_volumes_come_back(volume):
    same_volumes(again(volume), volume)


def test_everything_of_a_volume_comes_back():
    array = np.array([[[0.1, 2, 3, 0]]])
    volume = esvr.Volume.from_numpy(array, background=-1, name="ü", metadata={"unit": "K", "n": 3}, voxel_size=0.5)
    back = again(volume)
    same_volumes(back, volume)
    assert back.rounded_values == volume.rounded_values == 1
    assert pickle.dumps(back) == pickle.dumps(volume)
    empty = esvr.Volume.from_numpy(np.zeros((2, 2, 2)))
    assert again(empty).active_voxels == 0 and again(empty).box is None


def test_the_inside_of_a_level_set_comes_back(tmp_path):
    x, y, z = np.mgrid[-20:21, -20:21, -20:21]
    distance = np.clip(np.sqrt(x * x + y * y + z * z) - 14, -3, 3)
    volume = esvr.Volume.from_numpy(distance, background=3, level_set=True, origin=(-20, -20, -20))
    volume.save(tmp_path / "s.vdb")
    packed = esvr.PackedGrid.from_file(tmp_path / "s.vdb")
    box = ((-20, -20, -20), (20, 20, 20))
    assert (packed.to_numpy(box) < 0)[20, 20, 20]
    assert np.array_equal(again(packed).to_numpy(box), packed.to_numpy(box))


@pytest.mark.parametrize("kind, dtype", [("float", "f4"), ("double", "f8"), ("int32", "i4"), ("int64", "i8"), ("bool", "?"),
                                         ("vec3s", "f4")])
def test_packed_grids_come_back(kind, dtype):
    values = np.arange(1, 2 * 3 * 4 * (3 if kind == "vec3s" else 1) + 1).reshape(2, 3, 4, *[3] * (kind == "vec3s"))
    builder = esvr.GridBuilder(kind, name="n", metadata={"a": 1.5})
    for x in (0, 8):
        builder.add(values.astype(dtype), origin=(x, 0, 0))
    grid = builder.finish()
    back = again(grid)
    assert np.array_equal(back.to_numpy(), grid.to_numpy()) and back.to_numpy().dtype == grid.to_numpy().dtype
    assert (back.name, back.value_type, back.box, back.metadata) == (grid.name, grid.value_type, grid.box, {"a": 1.5})


def test_grids_and_files_come_back(volume, grid, tmp_path):
    back = again(grid)
    assert np.array_equal(back.to_volume().to_numpy(), grid.to_volume().to_numpy())
    assert back.bytes == grid.bytes and back.kind == grid.kind
    volume.save(tmp_path / "a.vdb")
    file = esvr.convert([volume, esvr.Volume.from_numpy(np.ones((3, 3, 3)), name="b")], psnr=40, device="cpu")
    other = again(file)
    assert other.names == file.names
    esvr.write(tmp_path / "a.esvr", file), esvr.write(tmp_path / "b.esvr", other)
    assert (tmp_path / "a.esvr").read_bytes() == (tmp_path / "b.esvr").read_bytes()
    metrics = esvr.compare(volume, grid)
    assert repr(again(metrics)) == repr(metrics) and again(metrics).psnr_t50 == metrics.psnr_t50
    ellipsoids = again(grid.ellipsoids)
    assert np.array_equal(ellipsoids.mu, grid.ellipsoids.mu) and not ellipsoids.kappa.flags.writeable


def psnr_of(volume, grid):
    return esvr.compare(volume, grid).psnr_box


def test_other_processes_take_and_give_them(volume, grid):
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        # A pool replaces processes that end, for ever.
        assert pool.apply_async(psnr_of, (volume, grid)).get(60) == psnr_of(volume, grid)


def test_voxels_are_passed_on_without_a_copy(volume):
    buffers = []
    data = pickle.dumps(volume, protocol=5, buffer_callback=buffers.append)
    assert len(data) < 2000 and sum(len(b.raw()) for b in buffers) > 50_000
    same_volumes(pickle.loads(data, buffers=buffers), volume)


def test_copies_are_the_objects_themselves(volume, grid):
    for thing in (volume, grid, grid.ellipsoids):
        assert copy.copy(thing) is thing and copy.deepcopy([thing])[0] is thing


def test_damaged_pickles_are_refused(volume):
    restore, (function, state) = volume.__reduce__()
    with pytest.raises(esvr.BadInput, match="another version"):
        restore(function, (99, *state[1:]))
    voxels = state[2]
    for wrong in ((voxels[0], voxels[1], voxels[2][:-1], *voxels[3:]), (*voxels[:4], voxels[4][:-1]),
                  (voxels[0], voxels[1], voxels[2][::-1], *voxels[3:])):
        with pytest.raises(esvr.BadInput, match="damaged"):
            restore(function, (*state[:2], wrong, *state[3:]))


def test_sequences_open_their_file_again(frames):
    sequence = esvr.Sequence(frames)
    assert again(sequence).frames == copy.copy(sequence).frames == [3, 4]
    assert repr(sequence).startswith("<esvr.Sequence '") and "2 frames" in repr(sequence)


def test_repr_says_shape_values_transform_and_bytes(volume, grid):
    assert repr(volume) == (f"<esvr.Volume 'density': fog volume, 19 x 19 x 19 voxels from (0, 103, 10), {volume.active_voxels} "
                            "active, values 0.01 to 1, voxel size 0.5, 57.3 KB of memory>")
    assert repr(grid).startswith("<esvr.Grid 'density': fog volume, 40 ellipsoids, 19 x 19 x 19 voxels from (0, 103, 10)")
    assert "values 0.01 to 1, voxel size 0.5, " in repr(grid) and repr(grid).endswith(" of a file>")
    turned = esvr.Volume.from_numpy(np.ones((1, 1, 1)), transform=[[0, 2, 0, 0], [-1, 0, 0, 0], [0, 0, 3, 0], [0, 0, 0, 1]])
    assert "voxel size 1 x 2 x 3, turned or sheared, 2.12 KB" in repr(turned)
    moved = esvr.Volume.from_numpy(np.ones((1, 1, 1)), transform=[[2, 0, 0, 5], [0, 2, 0, 0], [0, 0, 2, -0.25], [0, 0, 0, 1]])
    assert "voxel size 2, voxel (0, 0, 0) at (5, 0, -0.25), " in repr(moved)
    assert "no active voxel" in repr(esvr.Volume.from_numpy(np.zeros((1, 1, 1))))


def test_repr_of_a_file_has_its_grids(volume):
    """One grid is on the line of the file, and each of several has a line."""
    of_grid = (f"'density': fog volume, stored as voxels, 19 x 19 x 19 voxels from (0, 103, 10), {volume.active_voxels} active, "
               "values 0.01 to 1, voxel size 0.5")
    one = repr(esvr.convert([volume], lossless=True, device="cpu"))
    assert one.startswith("<esvr.File: 1 grid, ") and one.endswith(f" of memory: {of_grid}>")
    ones = esvr.Volume.from_numpy(np.ones((2, 2, 2)), name="b", transform=np.diag([1, 2, 3, 1]), grid_class="unknown")
    head, first, second = repr(esvr.convert([volume, ones], lossless=True, device="cpu")).split("\n  ")
    assert head.startswith("<esvr.File: 2 grids, ") and first == of_grid
    assert second == "'b': stored as voxels, 2 x 2 x 2 voxels from (0, 0, 0), 8 active, values 1 to 1, voxel size 1 x 2 x 3>"
    many = repr(esvr.convert([ones] * 25, lossless=True, device="cpu"))
    assert many.count("\n") == 21 and "'b[1]': " in many and many.endswith("\n  and 5 more>")


def test_dask_knows_equal_objects(volume, grid):
    """Otherwise, Dask would compute again what it has a result of."""
    tokenize = pytest.importorskip("dask.base", reason="Debian: python3-dask").tokenize
    file = esvr.convert([volume], lossless=True, device="cpu")
    things = [volume, grid, file, grid.ellipsoids, esvr.compare(volume, grid)]
    for thing in things:
        assert tokenize(thing) == tokenize(again(thing)) == tokenize(copy.copy(thing))
    assert len({tokenize(thing) for thing in things}) == len(things)
    larger = esvr.Volume.from_numpy(volume.to_numpy(), origin=volume.box[0], voxel_size=0.6)
    assert tokenize(larger) != tokenize(volume)
