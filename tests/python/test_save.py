"""Files are saved as VDB as esvr2vdb writes them, and sequences are read in their order."""
import numpy as np
import pytest

import esvr


@pytest.fixture
def path(tmp_path, grid):
    esvr.write(tmp_path / "ball.esvr", [grid])
    return tmp_path / "ball.esvr"


UUID = slice(21, 57)  # of a .vdb file, which is another one each time


def content(path):
    data = bytearray(path.read_bytes())
    del data[UUID]
    return bytes(data)


@pytest.mark.parametrize("part, options", [
    ({}, []),
    ({"box": ((0, 105, 10), (7, 112, 17))}, ["--bbox", "0,105,10,7,112,17"]),
    ({"layers": 1}, ["--lod", "1"]),
    ({"max_ellipsoids": 10}, ["--max-ellipsoids", "10"])])
def test_a_saved_file_is_that_of_esvr2vdb(tmp_path, path, part, options, run):
    assert esvr.read(path).save(tmp_path / "saved.vdb", **part) == []
    run("esvr2vdb", path, tmp_path / "written.vdb", *options)
    assert content(tmp_path / "saved.vdb") == content(tmp_path / "written.vdb")


def carrying(tmp_path, run, *names):
    """A file of two grids, of which those named are carried."""
    run("esvr-sample", "two-grids", tmp_path / "two.vdb", "--resolution", "16")
    keep = [word for name in names for word in ("--keep", name)]
    run("vdb2esvr", tmp_path / "two.vdb", tmp_path / "two.esvr", "-q", *keep)
    return esvr.read(tmp_path / "two.esvr")


def test_carried_grids_are_saved_unless_the_file_is_cut(tmp_path, run):
    file = carrying(tmp_path, run, "density")
    assert file.carried == ["density"] and len(file) == 1
    assert file.save(tmp_path / "whole.vdb") == []
    assert file.save(tmp_path / "cut.vdb", box=((0, 0, 0), (9, 9, 9))) == ["density"]
    assert [name for name, _ in esvr.list_grids(tmp_path / "whole.vdb")] == ["density", "temperature"]
    assert [name for name, _ in esvr.list_grids(tmp_path / "cut.vdb")] == ["temperature"]


def test_a_file_without_a_grid_that_can_be_cut_is_refused(tmp_path, run):
    file = carrying(tmp_path, run, "density", "temperature")
    with pytest.raises(esvr.BadInput, match="no grid is left"):
        file.save(tmp_path / "cut.vdb", box=((0, 0, 0), (9, 9, 9)))


def test_a_file_is_not_replaced_unless_it_is_wanted(tmp_path, path):
    file = esvr.read(path)
    file.save(tmp_path / "a.vdb")
    with pytest.raises(esvr.Error, match="exists"):
        file.save(tmp_path / "a.vdb")
    file.save(tmp_path / "a.vdb", overwrite=True)


@pytest.mark.parametrize("part, text", [({"layers": 0}, "layers"), ({"max_ellipsoids": 0}, "max_ellipsoids"),
                                        ({"box": ((1, 0, 0), (0, 0, 0))}, "empty")])
def test_wrong_parts_are_refused(tmp_path, path, part, text):
    with pytest.raises(esvr.UsageError, match=text):
        esvr.read(path).save(tmp_path / "a.vdb", **part)
    assert not (tmp_path / "a.vdb").exists()


def test_a_sequence_has_the_frames_that_read_gives(frames, ball):
    sequence = esvr.Sequence(frames)
    assert sequence.frames == [3, 4]
    read = [sequence.read(frame)["density"].to_volume() for frame in (3, 4, 3)]
    for frame, volume in zip((3, 4, 3), read):  # a frame is not changed by reading another one
        assert np.array_equal(volume.to_numpy(((0, 0, 0), (24, 24, 24))), ball * frame)
    with pytest.raises(esvr.BadInput, match="no frame 5"):
        sequence.read(5)


def test_a_file_of_one_frame_is_no_sequence(path):
    with pytest.raises(esvr.BadInput, match="sequence"):
        esvr.Sequence(path)
