"""Volumes that several tests need."""
import os
import pathlib
import subprocess

import numpy as np
import pytest

import esvr


@pytest.fixture(scope="session")
def ball():
    """A soft ball of radius 10 around (12, 12, 12), whose values fall from 1 to 0."""
    x, y, z = np.mgrid[0:25, 0:25, 0:25]
    r2 = (x - 12) ** 2 + (y - 12) ** 2 + (z - 12) ** 2
    return np.maximum(0.0, 1.0 - r2 / 100.0).astype(np.float32)


@pytest.fixture(scope="session")
def volume(ball):
    return esvr.Volume.from_numpy(ball, origin=(-3, 100, 7), voxel_size=0.5)


@pytest.fixture(scope="session")
def grid(volume):
    return esvr.fit(volume, count=40, preset="draft", representation="ellipsoids", device="cpu")


@pytest.fixture(scope="session")
def run():
    """Runs a program of the build and returns what it prints; tests that need one are skipped without it."""
    def run_program(name, *words):
        program = pathlib.Path(os.environ.get("ESVR_BIN", "/nowhere")) / {"esvr-sample": "samples"}.get(name, name) / name
        if not program.is_file():
            pytest.skip(f"ESVR_BIN has no {name}")
        return subprocess.run([program, *words], check=True, text=True, stdout=subprocess.PIPE).stdout
    return run_program


@pytest.fixture
def frames(tmp_path, ball, run):
    """A file with the ball as frame 3 and 4, times the number of the frame."""
    for frame in (3, 4):
        esvr.Volume.from_numpy(ball * frame).save(tmp_path / f"b.{frame}.vdb")
    run("vdb2esvr", tmp_path / "b.@.vdb", tmp_path / "b.esvr", "--lossless", "-q")
    return tmp_path / "b.esvr"


@pytest.fixture
def data():
    """The folder of real volumes; tests that need it are skipped without one."""
    folder = os.environ.get("ESVR_DATA_DIR", "")
    if not folder:
        pytest.skip("ESVR_DATA_DIR is not set")
    return pathlib.Path(folder)
