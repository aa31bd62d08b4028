"""esvr.convert gives the bytes of vdb2esvr, from a file and from volumes."""
import numpy as np
import pytest

import esvr


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
    with pytest.raises(esvr.UsageError, match="without any fitted grid"):
        esvr.convert(source, size=200)
    with pytest.raises(esvr.BadInput, match="missing.vdb"):
        esvr.convert(tmp_path / "missing.vdb")
    with pytest.raises(esvr.UsageError, match="exclude"):
        esvr.convert(source, psnr=40, size=9000)

    def refuse(share):
        raise KeyError("stop")
    with pytest.raises(KeyError):
        esvr.convert([esvr.Volume.from_numpy(ball)], count=50, representation="ellipsoids", progress=refuse)
