"""Plan: grids of all types are made of arrays slab by slab, in several orders of their axes, written, read back
from .vdb and .esvr and compared with the arrays. pyopenvdb, where it is installed, reads the same voxels.
"""
import numpy as np
import pytest

import esvr

SHAPE = (13, 21, 18)
TYPES = {"float": np.float32, "double": np.float64, "int32": np.int32, "int64": np.int64, "bool": np.bool_,
         "vec3s": np.float32}


def array_of(kind, seed=7):
    generator = np.random.default_rng(seed)
    shape = SHAPE + (3,) if kind == "vec3s" else SHAPE
    whole = generator.integers(-3, 3, shape)
    if kind == "int64":
        return np.where(whole > 0, whole.astype(np.int64) * 9007199254740993, 0)
    if kind == "int32":
        return np.where(whole > 0, whole * 2 ** 29 + 1, 0).astype(np.int32)
    if kind == "double":
        return whole * 0.1
    return (whole > 0) if kind == "bool" else (whole * 0.25).astype(np.float32)


def built(kind, array, step=8, axis=2, **options):
    builder = esvr.GridBuilder(kind, **options)
    for first in range(0, array.shape[axis], step):
        place = [slice(None)] * array.ndim
        place[axis] = slice(first, first + step)
        origin = [0, 0, 0]
        origin[axis] = first
        builder.add(array[tuple(place)], tuple(origin))
    return builder.finish()


@pytest.mark.parametrize("kind", TYPES)
@pytest.mark.parametrize("order", ["C", "F"])
def test_slabs_of_all_types_give_the_grid_of_the_whole_array(kind, order, tmp_path):
    array = np.asarray(array_of(kind), order=order)
    box = ((0, 0, 0), tuple(n - 1 for n in SHAPE))
    active = array.any(axis=3) if kind == "vec3s" else array != 0
    path = tmp_path / "a.vdb"
    for axis in range(3):
        grid = built(kind, array, axis=axis, name="a")
        esvr.write_vdb(path, [grid], overwrite=True)
        for made in (grid, esvr.PackedGrid.from_file(path)):
            assert made.value_type == kind and made.name == "a"
            back = made.to_numpy(box, order=order)
            assert back.dtype == TYPES[kind] and np.array_equal(back, array)
            assert np.array_equal(made.active(box), active)
            assert made.active_voxels == active.sum()


def test_voxels_are_read_slab_by_slab_in_either_order():
    array = array_of("int64")
    grid = built("int64", array)
    for z in range(0, SHAPE[2], 5):
        last = min(z + 4, SHAPE[2] - 1)
        slab = grid.to_numpy(((0, 0, z), (SHAPE[0] - 1, SHAPE[1] - 1, last)), order="F")
        assert slab.flags.f_contiguous and np.array_equal(slab, array[:, :, z:last + 1])
    beyond = grid.to_numpy(((-9, 3, 2), (-3, 4, 40)))
    assert beyond.shape == (7, 2, 39) and not beyond.any()
    with pytest.raises(esvr.UsageError, match="order"):
        grid.to_numpy(order="A")


def test_a_threshold_and_a_mask_choose_the_active_voxels():
    array = np.arange(512, dtype=np.uint16).reshape(8, 8, 8)
    grid = built("float", array, threshold=500)
    assert grid.active_voxels == 12 and grid.to_numpy().max() == 511
    builder = esvr.GridBuilder("int32", background=-1)
    mask = np.zeros((8, 8, 8), bool)
    mask[0, 0, 0] = mask[7, 7, 7] = True
    builder.add(array.astype(np.int32), active=mask)
    grid = builder.finish()
    assert grid.active_voxels == 2 and grid.background == -1
    assert grid.to_numpy(((0, 0, 0), (0, 0, 1))).ravel().tolist() == [0, -1]


def test_name_class_transform_and_metadata_come_back(tmp_path):
    matrix = np.array([[0, -2, 0, 5], [1, 0, 0, 6], [0, 0, 3, 7], [0, 0, 0, 1.0]])
    metadata = {"text": "µm", "number": 0.1, "count": 2 ** 40, "true": True, "size": (1, 2, 3), "place": (0.5, 1.0, 2.0)}
    grids = [built(kind, array_of(kind), name=f"{kind}!", transform=matrix, metadata=metadata, grid_class="fog volume")
             for kind in TYPES]
    path = tmp_path / "all.vdb"
    esvr.write_vdb(path, grids, metadata={"from": "a test"})
    assert esvr.list_grids(path) == [(f"{kind}!", kind) for kind in TYPES]
    for place, kind in enumerate(TYPES):
        grid = esvr.PackedGrid.from_file(path, place)
        assert grid.name == f"{kind}!" and grid.grid_class == "fog volume"
        assert np.array_equal(grid.transform, matrix)
        assert {name: grid.metadata[name] for name in metadata} == metadata
    with pytest.raises(esvr.UsageError, match="name one"):
        esvr.PackedGrid.from_file(path)
    with pytest.raises(esvr.BadInput, match="no grid number 6"):
        esvr.PackedGrid.from_file(path, 6)
    with pytest.raises(esvr.Error):
        esvr.write_vdb(path, grids)


@pytest.mark.parametrize("kind", TYPES)
def test_an_empty_grid_is_written_and_read(kind, tmp_path):
    shape = (8, 8, 8, 3) if kind == "vec3s" else (8, 8, 8)
    grid = built(kind, np.zeros(shape, TYPES[kind]), name="none")
    assert grid.active_voxels == 0 and grid.box is None
    path = tmp_path / "none.vdb"
    esvr.write_vdb(path, [grid])
    read = esvr.PackedGrid.from_file(path)
    assert read.box is None and read.value_type == kind
    assert not read.to_numpy(((0, 0, 0), (2, 2, 2))).any()


@pytest.mark.parametrize("kind, array, text", [
    ("float", np.zeros((8, 8, 8), np.int32), "takes no array of int32"),
    ("float", np.zeros((8, 8, 8), ">f4"), "takes no array"),
    ("int64", np.zeros((8, 8, 8), np.uint64), "takes no array of uint64"),
    ("int32", np.zeros((8, 8), np.int32), "axes x, y, z"),
    ("vec3s", np.zeros((8, 8, 8, 4), np.float32), "three components"),
    ("int16", np.zeros((8, 8, 8), np.int16), "type is one of")])
def test_arrays_that_a_grid_cannot_hold_exactly_are_refused(kind, array, text):
    with pytest.raises(esvr.UsageError, match=text):
        esvr.GridBuilder(kind).add(array)


def test_misplaced_slabs_and_wrong_options_are_refused():
    ones = np.ones((8, 8, 8), np.float32)
    builder = esvr.GridBuilder()
    with pytest.raises(esvr.UsageError, match="multiples of 8"):
        builder.add(ones, (0, 4, 0))
    builder.add(ones)
    builder.add(ones)
    with pytest.raises(esvr.UsageError, match="two boxes"):
        builder.finish()
    with pytest.raises(esvr.UsageError, match="another size"):
        esvr.GridBuilder().add(ones, active=np.ones((8, 8, 7), bool))
    with pytest.raises(esvr.UsageError, match="whole number"):
        esvr.GridBuilder("int32", background=2 ** 31)
    with pytest.raises(esvr.UsageError, match="invertible"):
        esvr.GridBuilder(transform=np.zeros((4, 4)))
    with pytest.raises(esvr.MemoryExceeded):
        esvr.GridBuilder(max_bytes=1000).add(ones)


def test_grids_of_an_esvr_file_are_decoded_and_carried_ones_are_read(tmp_path, run):
    source, stored = tmp_path / "in.vdb", tmp_path / "in.esvr"
    kinds = [kind for kind in TYPES if kind != "double"]
    arrays = {kind: array_of(kind) for kind in kinds}
    esvr.write_vdb(source, [built(kind, arrays[kind], name=kind) for kind in kinds])
    run("vdb2esvr", source, stored, "--lossless", "-q")
    assert esvr.list_grids(stored) == [(kind, kind) for kind in kinds]
    box = ((0, 0, 0), tuple(n - 1 for n in SHAPE))
    for kind in kinds:
        grid = esvr.PackedGrid.from_file(stored, kind)
        assert grid.value_type == kind and np.array_equal(grid.to_numpy(box), arrays[kind])
    assert np.array_equal(esvr.PackedGrid.from_file(stored, "vec3s.y").to_numpy(box), arrays["vec3s"][..., 1])
    with pytest.raises(esvr.UsageError, match="frames"):
        esvr.PackedGrid.from_file(source, kinds[0], frame=1)


@pytest.mark.parametrize("radius", [25, 7])  # with bricks inside of which no voxel is active, and without
@pytest.mark.parametrize("only_the_band", [True, False])
def test_a_level_set_is_negative_inside(tmp_path, radius, only_the_band):
    x, y, z = np.mgrid[0:64, 0:64, 0:64] - 31.5
    distance = (np.sqrt(x * x + y * y + z * z) - radius).astype(np.float32)
    volume = esvr.Volume.from_numpy(np.clip(distance, -3, 3), background=3, level_set=True,
                                    active=np.abs(distance) < 3 if only_the_band else None)
    path = tmp_path / "ball.vdb"
    volume.save(path)
    grid = esvr.PackedGrid.from_file(path)
    values = grid.to_numpy(((0, 0, 0), (63, 63, 63)))
    assert values[32, 32, 32] == -3 and values[0, 0, 0] == 3
    again = tmp_path / "again.vdb"
    esvr.write_vdb(again, [grid])
    assert np.array_equal(esvr.PackedGrid.from_file(again).to_numpy(((0, 0, 0), (63, 63, 63))), values)


def test_a_grid_of_floats_becomes_a_volume():
    array = array_of("float")
    volume = built("float", array, name="v").to_volume()
    assert volume.name == "v" and np.array_equal(volume.to_numpy(((0, 0, 0), tuple(n - 1 for n in SHAPE))), array)
    with pytest.raises(esvr.UsageError, match="int32"):
        built("int32", array_of("int32")).to_volume()


@pytest.mark.parametrize("kind", ["float", "bool", "vec3s"])  # Debian's pyopenvdb has no others
def test_pyopenvdb_reads_the_same_voxels(kind, tmp_path):
    openvdb = pytest.importorskip("pyopenvdb")
    array = array_of(kind)
    path = tmp_path / "a.vdb"
    esvr.write_vdb(path, [built(kind, array, name="a", metadata={"note": "n"})])
    grid = openvdb.read(str(path), "a")
    back = np.zeros(array.shape, array.dtype)
    grid.copyToArray(back)
    assert np.array_equal(back, array) and grid["note"] == "n"
