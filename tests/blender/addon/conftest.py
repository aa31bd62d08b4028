"""Files that several tests need. They are made once by the programs of the build."""
import os
import pathlib
import subprocess

import pytest

BUILD = pathlib.Path(os.environ["ESVR_BIN"])
FRAMES = (7, 8, 10)


class Programs:
    esvr2vdb = str(BUILD / "esvr2vdb/esvr2vdb")
    vdb2esvr = str(BUILD / "vdb2esvr/vdb2esvr")
    sample = str(BUILD / "samples/esvr-sample")

    @staticmethod
    def run(*words):
        done = subprocess.run([str(word) for word in words], text=True, capture_output=True)
        assert done.returncode == 0, done.stderr
        return done.stdout


class Files:
    """A folder whose name is neither plain nor in one language, with a volume, a sequence and damaged files."""

    def __init__(self, folder):
        self.folder = folder
        self.vdb, self.file = folder / "plume.vdb", folder / "two words.esvr"
        Programs.run(Programs.sample, "two-grids", self.vdb, "--resolution", "24")
        options = ["--representation", "ellipsoids", "--count", "60", "--preset", "draft", "--device", "cpu"]
        Programs.run(Programs.vdb2esvr, self.vdb, self.file, *options)
        self.make_sequence()
        self.damaged = folder / "damaged.esvr"
        self.damaged.write_bytes(self.file.read_bytes()[:-30])

    def make_sequence(self):
        for frame, side in zip(FRAMES, (16, 20, 24)):
            Programs.run(Programs.sample, "plume", self.folder / f"s_{frame:04d}.vdb", "--resolution", side)
        self.sequence = self.folder / "all frames.esvr"
        self.numbered = str(self.folder / "n.####.esvr")
        frames = ["--frames", ",".join(map(str, FRAMES)), "--device", "cpu", "--preset", "draft"]
        # In the folder, because the name of the folder contains what means a number.
        for output in ("all frames.esvr", "n.####.esvr"):
            subprocess.run([Programs.vdb2esvr, "s_####.vdb", output, *frames], cwd=self.folder, check=True,
                           capture_output=True)


@pytest.fixture(scope="session")
def programs():
    return Programs


@pytest.fixture(scope="session")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("files") / "Bücher #1"
    folder.mkdir()
    return Files(folder)


@pytest.fixture
def data():
    """The folder of real volumes; tests that need it are skipped without one."""
    folder = os.environ.get("ESVR_DATA_DIR", "")
    if not folder:
        pytest.skip("ESVR_DATA_DIR is not set")
    return pathlib.Path(folder)
