"""Grids are fitted, written, read, decoded, evaluated and drawn."""
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

import esvr


def test_a_fit_is_near_its_source(volume, grid):
    assert grid.kind == "ellipsoids" and grid.ellipsoid_count == 40
    quality = esvr.compare(volume, grid)
    assert quality.psnr_box > 35.0
    assert quality.psnr_t90 > quality.psnr_t50 > 30.0 and quality.psnr_t10 > 20.0 and quality.median_depth > 0.0


def test_goals_are_reached(volume):
    assert esvr.compare(volume, esvr.fit(volume, psnr=50, device="cpu")).psnr_box >= 50.0
    assert esvr.compare(volume, esvr.fit(volume, max_error=0.01)).max_error <= 0.01
    relative = esvr.fit(volume, max_relative_error=0.01, relative_floor=1.0)
    assert 0.0 < esvr.compare(volume, relative).max_error <= 0.01 * max(1.0, *map(abs, volume.value_range))
    assert esvr.compare(volume, esvr.fit(volume, lossless=True)).max_error == 0.0
    assert esvr.fit(volume, size=2000, device="cpu").bytes <= 2000


def test_goals_exclude_each_other(volume):
    with pytest.raises(esvr.UsageError, match="exclude"):
        esvr.fit(volume, psnr=30, count=10)
    with pytest.raises(esvr.UsageError, match="relative_floor"):
        esvr.fit(volume, relative_floor=0.1)
    with pytest.raises(esvr.UsageError, match="preset is one of draft"):
        esvr.fit(volume, preset="best")
    with pytest.raises(esvr.BadInput):
        esvr.fit(esvr.Volume.from_numpy(np.zeros((3, 3, 3))))


def test_the_same_seed_gives_the_same_bytes(tmp_path, volume, grid):
    again = esvr.fit(volume, count=40, preset="draft", representation="ellipsoids", device="cpu")
    esvr.write(tmp_path / "a.esvr", [grid])
    esvr.write(tmp_path / "b.esvr", [again])
    assert (tmp_path / "a.esvr").read_bytes() == (tmp_path / "b.esvr").read_bytes()


def test_files_keep_grids(tmp_path, grid):
    path = tmp_path / "ball.esvr"
    size = esvr.write(path, [grid])
    assert size == path.stat().st_size
    file = esvr.read(path)
    assert len(file) == 1 and file.carried == [] and esvr.frames(path) == []
    # A file has its ellipsoids in another order, in which float32 sums round differently.
    assert np.allclose(file["density"].to_volume().to_numpy(), grid.to_volume().to_numpy(), atol=1e-5)
    copy = tmp_path / "copy.esvr"
    esvr.write(copy, file)
    assert copy.read_bytes() == path.read_bytes()
    with pytest.raises(esvr.Error, match="exists"):
        esvr.write(path, file)
    with pytest.raises(KeyError, match="there are: density"):
        file["flame"]


def test_grids_outlive_their_file(tmp_path, grid):
    esvr.write(tmp_path / "ball.esvr", [grid])
    assert esvr.read(tmp_path / "ball.esvr").grids[0].to_volume().active_voxels > 0


def test_damaged_files_are_refused(tmp_path, grid):
    path = tmp_path / "ball.esvr"
    esvr.write(path, [grid])
    path.write_bytes(path.read_bytes()[:-20])
    with pytest.raises(esvr.BadInput, match="ball.esvr"):
        esvr.read(path)


def test_attributes_have_the_shapes_of_arrays(grid):
    e = grid.ellipsoids
    n = len(e)
    assert [a.shape for a in (e.mu, e.scale, e.quaternion, e.intensity, e.kappa)] == [
        (n, 3), (n, 3), (n, 4), (n,), (n,)]
    assert np.allclose(np.linalg.norm(e.quaternion, axis=1), 1.0, atol=1e-5)
    assert e.mu is not None and np.shares_memory(e.mu, e.mu[:1]) and not e.mu.flags.writeable


def value_by_definition(grid, point):
    """The sum in float64, by the formulas of docs/math.md."""
    e = grid.ellipsoids
    w, x, y, z = e.quaternion.T.astype(float)
    rotation = np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                         [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                         [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])
    local = np.einsum("abn,na->nb", rotation, point - e.mu) / e.scale
    edge = np.exp(e.kappa.astype(float))
    quotient = (1 + edge) / (edge + np.exp(np.minimum((local ** 2).sum(axis=1), 700.0)))
    phi = np.maximum(quotient - e.epsilon, 0.0) / (1 - e.epsilon)
    return np.clip(grid.background + (e.intensity * phi).sum(), 0.0, grid.value_range[1])


def test_points_have_the_values_of_the_definition(grid):
    points = np.random.default_rng(1).uniform((0, 103, 10), (18, 121, 28), (200, 3))
    # Float32 sums of 40 terms below 1, and a support that ends a rounding error away.
    assert np.allclose(grid.evaluate(points), [value_by_definition(grid, p) for p in points], atol=2e-5)


def test_points_at_voxels_have_their_values(grid):
    box = grid.box
    points = np.argwhere(np.ones(np.subtract(box[1], box[0]) + 1)) + box[0]
    decoded = grid.to_volume().to_numpy(box).ravel()
    values = grid.evaluate(points)
    active = decoded != 0
    # Both sum float32 numbers, in different orders.
    assert np.allclose(values[active], decoded[active], atol=1e-5)


def test_points_are_checked(grid):
    assert grid.evaluate(np.zeros((0, 3))).shape == (0,)
    with pytest.raises(esvr.UsageError, match=r"\(n, 3\)"):
        grid.evaluate(np.zeros(3))
    with pytest.raises(esvr.UsageError, match="finite"):
        grid.evaluate([[np.nan, 0, 0]])


def test_stored_voxels_are_not_evaluated(volume):
    with pytest.raises(esvr.UsageError, match="to_volume"):
        esvr.fit(volume, lossless=True).evaluate([[0, 0, 0]])


def test_a_box_selects_voxels_and_ellipsoids(tmp_path, grid):
    esvr.write(tmp_path / "ball.esvr", [grid])
    box = ((0, 108, 12), (4, 110, 14))
    part = esvr.read(tmp_path / "ball.esvr", box=box).grids[0]
    assert part.ellipsoid_count <= grid.ellipsoid_count
    assert np.allclose(part.to_volume(box).to_numpy(box), grid.to_volume().to_numpy(box), atol=1e-5)
    with pytest.raises(esvr.UsageError, match="empty"):
        grid.to_volume(((1, 0, 0), (0, 0, 0)))


def test_frames_of_a_sequence_are_read(frames, ball):
    assert esvr.frames(frames) == [3, 4]
    for frame in (4, 3):
        grid = esvr.read(frames, frame=frame)["density"]
        assert np.array_equal(grid.to_volume().to_numpy(((0, 0, 0), (24, 24, 24))), ball * frame)
    with pytest.raises(esvr.UsageError, match="frame"):
        esvr.read(frames)
    with pytest.raises(esvr.BadInput, match="no frame 5"):
        esvr.read(frames, frame=5)


def test_pictures_of_grids_are_those_of_their_voxels(grid):
    picture = grid.render(80, 60)
    assert picture.shape == (60, 80, 4) and picture.dtype == np.uint8 and picture.any()
    voxels = grid.to_volume().render(80, 60, range=(0, grid.value_range[1]))
    assert np.abs(picture.astype(int) - voxels).mean() < 2.0


def test_a_background_makes_pictures_opaque(grid):
    picture = grid.render(40, 40, background=(1, 0, 0))
    assert (picture[..., 3] == 255).all() and (picture[0, 0] == (255, 0, 0, 255)).all()


def test_looks_are_checked(grid):
    with pytest.raises(esvr.UsageError, match="viridis"):
        grid.render(40, 40, colors="nonsense")
    with pytest.raises(esvr.UsageError):
        grid.render(0, 40)


def test_progress_is_reported_and_its_exceptions_end_the_fit(volume):
    shares = []
    esvr.fit(volume, psnr=45, device="cpu", representation="ellipsoids", progress=shares.append)
    assert shares and all(0.0 <= share <= 1.0 for share in shares)

    def fail(share):
        raise LookupError("enough")

    with pytest.raises(LookupError, match="enough"):
        esvr.fit(volume, count=500, device="cpu", representation="ellipsoids", progress=fail)


LONG = """
import esvr, numpy
x = numpy.random.default_rng(1).random((96, 96, 96))
print("begun", flush=True)
try:
    esvr.fit(esvr.Volume.from_numpy(x), count=20000, representation="ellipsoids", device="cpu", preset="high")
except KeyboardInterrupt:
    print("interrupted", flush=True)
"""


def test_ctrl_c_ends_a_fit():
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    run = subprocess.Popen([sys.executable, "-c", LONG], stdout=subprocess.PIPE, text=True, env=environment)
    assert run.stdout.readline() == "begun\n"
    time.sleep(1.0)
    run.send_signal(signal.SIGINT)
    assert run.communicate(timeout=60)[0] == "interrupted\n"
    assert run.returncode == 0


def test_jupyter_shows_a_picture_and_a_table(volume, grid):
    for shown in (volume, grid):
        text = shown._repr_html_()
        assert "data:image/png;base64," in text and "active voxels" in text
    empty = esvr.Volume.from_numpy(np.zeros((2, 2, 2)), name="<b>")
    assert "&lt;b&gt;" in empty._repr_html_() and "<img" not in empty._repr_html_()


def test_real_files_are_fitted(data, tmp_path):
    volume = esvr.Volume.from_vdb(data / "cube_levelset.vdb")
    grid = esvr.fit(volume, lossless=True)
    assert volume.grid_class == "level set" and esvr.compare(volume, grid).max_error == 0.0
    assert esvr.compare(volume, grid).psnr_t50 is None
    assert grid.render(64, 64, device="cpu").any()


def test_pictures_have_the_proportions_of_the_world():
    def wide(transform):
        array = np.zeros((12, 12, 12), np.float32)
        array[2:10, 2:10, 2:10] = 1.0
        builder = esvr.GridBuilder(transform=transform)
        builder.add(array)
        volume = builder.finish().to_volume()
        shown = volume.render(60, 60, eye=(60, 5, 5), center=(5, 5, 5), colors="grayscale")[..., 3] > 0
        return np.ptp(np.nonzero(shown.any(axis=0))[0]), np.ptp(np.nonzero(shown.any(axis=1))[0])

    width, height = wide(np.eye(4))
    assert abs(width - height) <= 1
    wider = wide(np.diag([1.0, 1.0, 2.0, 1.0]))
    assert wider[0] > 1.7 * wider[1] - 2
