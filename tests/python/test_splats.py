"""Splats are written and read as esvr2vdb does it."""
import numpy as np
import pytest

import esvr


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


def test_wrong_arguments_are_refused(tmp_path, grid):
    with pytest.raises(esvr.UsageError, match="up must"):
        esvr.write_splats(tmp_path / "a.ply", grid, up="x")
    with pytest.raises(esvr.UsageError, match=".ply or .usda"):
        esvr.write_splats(tmp_path / "a.splat", grid)
    (tmp_path / "no.ply").write_text("ply\n")
    with pytest.raises(esvr.BadInput, match="no end"):
        esvr.read_splats(tmp_path / "no.ply")
