"""Files are converted, saved and written as splats with the bytes that the programs write, and mistyped words are answered with
the nearest ones. Sequences are read in their order."""
import numpy as np
import pytest

import esvr
from esvr.images import image2vdb


def packed(name, array, type="float"):
    builder = esvr.GridBuilder(type, name=name, grid_class="fog volume" if type == "float" else "unknown")
    builder.add(array)
    return builder.finish()


@pytest.fixture
def source(tmp_path, ball):
    """A file of two grids that are alike, two that are equal, vectors, and integers."""
    x, y, z = np.mgrid[0:25, 0:25, 0:25]
    wind = np.stack([ball * 2, ball * np.sin(x / 5), ball * (y - 12) / 9], axis=-1).astype(np.float32)
    other = np.roll(ball, 3, axis=0) ** 2
    grids = [packed("density", ball), packed("heat", 300 * ball), packed("red", other), packed("wind", wind, "vec3s"),
             packed("blue", other), packed("count", (8 * ball).astype(np.int32), "int32")]
    path = tmp_path / "source.vdb"
    esvr.write_vdb(path, grids, metadata={"creator": "a test"})
    return path


@pytest.mark.parametrize("goal, options", [
    ({}, []),
    ({"size": 9000}, ["--size", "9000"]),
    ({"lossless": True}, ["--lossless"]),
    ({"max_error": 0.02}, ["--max-error", "0.02"]),
    ({"preset": "draft", "representation": "ellipsoids"}, ["--preset", "draft", "--representation", "ellipsoids"])])
def test_a_converted_file_is_that_of_vdb2esvr(tmp_path, source, goal, options, run):
    file = esvr.convert(source, device="cpu", **goal)
    esvr.write(tmp_path / "python.esvr", file)
    run("vdb2esvr", source, tmp_path / "program.esvr", "--device", "cpu", "-q", *options)
    assert (tmp_path / "python.esvr").read_bytes() == (tmp_path / "program.esvr").read_bytes()


def test_volumes_share_what_they_have_in_common(tmp_path, ball):
    volumes = [esvr.Volume.from_numpy(ball, name="density"), esvr.Volume.from_numpy(40 * ball, name="heat")]
    file = esvr.convert(volumes, representation="voxels", device="cpu")
    alone = [esvr.fit(volume, representation="voxels", device="cpu") for volume in volumes]
    apart = esvr.write(tmp_path / "apart.esvr", alone)
    assert 5 * esvr.write(tmp_path / "together.esvr", file) < 4 * apart
    assert file.names == ["density", "heat"]


def test_what_is_amiss_is_told(tmp_path, source, ball):
    with pytest.raises(esvr.UsageError, match=f"{source}: .*without any fitted grid"):
        esvr.convert(source, size=200)
    for psnr in (-1, float("nan")):
        with pytest.raises(esvr.UsageError, match="finite and not below 0 dB"):
            esvr.fit(esvr.Volume.from_numpy(ball), psnr=psnr)
    with pytest.raises(esvr.BadInput, match="missing.vdb"):
        esvr.convert(tmp_path / "missing.vdb")
    with pytest.raises(esvr.UsageError, match="exclude"):
        esvr.convert(source, psnr=40, size=9000)

    def refuse(share):
        raise KeyError("stop")
    with pytest.raises(KeyError):
        esvr.convert([esvr.Volume.from_numpy(ball)], count=50, representation="ellipsoids", progress=refuse)


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


def test_carried_grids_have_coarser_voxels(tmp_path, run):
    file = carrying(tmp_path, run, "density")
    assert file.save(tmp_path / "coarse.vdb", coarsen=2) == []
    assert [name for name, _ in esvr.list_grids(tmp_path / "coarse.vdb")] == ["density", "temperature"]
    fine, coarse = (esvr.Volume.from_vdb(tmp_path / name, "density") for name in ("two.vdb", "coarse.vdb"))
    assert coarse.transform[0, 0] == 2 * fine.transform[0, 0]
    assert coarse.to_numpy().sum() == pytest.approx(fine.to_numpy().sum() / 8, rel=1e-3)  # halfs


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


@pytest.mark.parametrize("name, arguments, options", [
    ("a.ply", {}, []),
    ("a.ply", {"kind": "mitsuba", "colors": (0.5, 0.25, 1.0), "up": "z"},
     ["--kind", "mitsuba", "--colors", "0.5,0.25,1", "--up", "z"]),
    ("a.usda", {"density_scale": 2.0}, ["--density-scale", "2"])])
def test_written_splats_are_those_of_esvr2vdb(tmp_path, grid, name, arguments, options, run):
    esvr.write(tmp_path / "ball.esvr", [grid])
    esvr.write_splats(tmp_path / name, esvr.read(tmp_path / "ball.esvr")["density"], **arguments)
    run("esvr2vdb", tmp_path / "ball.esvr", tmp_path / ("of-" + name), *options)
    assert (tmp_path / name).read_bytes() == (tmp_path / ("of-" + name)).read_bytes()


def test_splats_are_read_as_density_and_color(tmp_path, grid, volume):
    esvr.write_splats(tmp_path / "ball.ply", grid, colors=(0.5, 0.25, 1.0))
    density, colors = esvr.read_splats(tmp_path / "ball.ply", voxel_size=0.5)
    mass, wanted = density.to_numpy().sum(), volume.to_numpy().sum()
    assert mass == pytest.approx(wanted, rel=0.05)
    values, red = density.to_numpy(), colors[0].to_numpy()
    assert np.allclose(red[values > 0.1 * values.max()], 0.5, atol=0.01)


def test_wrong_arguments_of_splats_are_refused(tmp_path, grid):
    with pytest.raises(esvr.UsageError, match="up must"):
        esvr.write_splats(tmp_path / "a.ply", grid, up="x")
    with pytest.raises(esvr.UsageError, match=".ply or .usda"):
        esvr.write_splats(tmp_path / "a.splat", grid)
    (tmp_path / "no.ply").write_text("ply\n")
    with pytest.raises(esvr.BadInput, match="no end"):
        esvr.read_splats(tmp_path / "no.ply")


def test_a_name_that_no_grid_has(volume):
    file = esvr.convert([volume], preset="draft", device="cpu")
    with pytest.raises(KeyError, match="there is no grid 'densty'; there are: density; did you mean 'density'\\?"):
        file["densty"]
    with pytest.raises(KeyError) as refused:
        file["velocity"]
    assert "did you mean" not in str(refused.value)


@pytest.mark.parametrize("words, meant", [
    ({"preset": "drfat"}, "draft"), ({"representation": "elipsoids"}, "ellipsoids"), ({"device": "cdua"}, "cuda"),
    ({"storage": "Compact"}, "compact")])
def test_a_word_that_an_argument_does_not_take(volume, words, meant):
    with pytest.raises(esvr.UsageError, match=f"; did you mean {meant}\\?"):
        esvr.fit(volume, **words)
    with pytest.raises(esvr.UsageError, match="; did you mean double\\?"):
        esvr.GridBuilder("duoble")


@pytest.mark.parametrize("words, meant", [
    (["--datset", "t"], "--dataset"), (["a.nii", "b.vdb", "--thresold=3"], "--threshold"), (["--endian", "litle"], "little"),
    (["--colour", "red"], None)])
def test_an_option_that_a_program_does_not_have(words, meant):
    with pytest.raises(esvr.UsageError) as refused:
        image2vdb.PARSER.parse(words)
    assert str(refused.value).endswith(f"; did you mean {meant}?") if meant else "did you mean" not in str(refused.value)
