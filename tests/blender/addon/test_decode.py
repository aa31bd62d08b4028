"""Both decoders write the voxels that esvr2vdb writes, and nothing else remains in the cache."""
import os
import subprocess

import esvr
import pytest
from conftest import FRAMES, Programs
from esvr_blender import cache, jobs
from esvr_blender.decode import ModuleDecoder, ProgramDecoder, Request, decode
from esvr_blender.source import Source

DECODERS = {"module": ModuleDecoder(esvr), "program": ProgramDecoder(Programs.esvr2vdb)}
UUID = slice(21, 57)  # of a .vdb file, which is another one each time


@pytest.fixture(params=DECODERS)
def decoder(request):
    return DECODERS[request.param]


def decoded(decoder, path, root, **settings):
    job = jobs.Job(lambda job: decode(job, Request(Source(str(path)), cache.Settings(**settings), str(root), decoder)))
    job.run()
    if job.error:
        raise job.error
    return job.result


def content(path):
    data = bytearray(open(path, "rb").read())
    del data[UUID]
    return bytes(data)


def expected(path, folder, *options):
    """What esvr2vdb writes for a file."""
    Programs.run(Programs.esvr2vdb, path, folder / "expected.vdb", "--force", *options)
    return content(folder / "expected.vdb")


@pytest.mark.parametrize("settings, options", [
    ({}, []),
    ({"layers": 1}, ["--lod", "1"]),
    ({"max_ellipsoids": 20}, ["--max-ellipsoids", "20"]),
    ({"box": (3, 3, 3, 12, 12, 12)}, ["--bbox", "3,3,3,12,12,12"]),
    ({"box": (0, 0, 0, 9, 9, 9), "max_ellipsoids": 30}, ["--bbox", "0,0,0,9,9,9", "--max-ellipsoids", "30"])])
def test_a_file_becomes_that_of_esvr2vdb(files, tmp_path, decoder, settings, options):
    entry = decoded(decoder, files.file, tmp_path / "cache", **settings)
    assert content(entry.first) == expected(files.file, tmp_path, *options)
    assert os.listdir(tmp_path / "cache") == [os.path.basename(entry.folder)]


def test_carried_grids_come_along(data, tmp_path, decoder):
    Programs.run(Programs.vdb2esvr, data / "sequence/gas_0004.vdb", tmp_path / "gas.esvr", "--lossless")
    entry = decoded(decoder, tmp_path / "gas.esvr", tmp_path / "cache")
    assert content(entry.first) == expected(tmp_path / "gas.esvr", tmp_path)


def test_what_is_in_the_cache_is_not_decoded_again(files, tmp_path, decoder):
    first = decoded(decoder, files.file, tmp_path)
    assert decoded(None, files.file, tmp_path) == first  # no decoder is asked


def frames_of(files, tmp_path):
    """What esvr2vdb writes for each frame."""
    subprocess.run([Programs.esvr2vdb, files.sequence, "x_####.vdb"], cwd=tmp_path, check=True)
    return {frame: content(tmp_path / f"x_{frame:04d}.vdb") for frame in FRAMES}


def test_the_frames_of_a_file_are_decoded(files, tmp_path, decoder):
    entry = decoded(decoder, files.sequence, tmp_path / "cache")
    assert {frame: content(os.path.join(entry.folder, name)) for frame, name in entry.files.items()} == frames_of(
        files, tmp_path)


def test_numbered_files_are_decoded(files, tmp_path, decoder):
    entry = decoded(decoder, files.numbered, tmp_path / "cache")
    assert entry.frames == list(FRAMES)
    for frame, name in entry.files.items():
        assert content(os.path.join(entry.folder, name)) == expected(files.folder / f"n.{frame:04d}.esvr", tmp_path)


@pytest.mark.parametrize("kind", ["sequence", "numbered"])
def test_some_frames_are_decoded(files, tmp_path, decoder, kind):
    assert decoded(decoder, getattr(files, kind), tmp_path, frames=(8, 9)).frames == [8]


def test_frames_may_be_decoded_in_part(files, tmp_path):
    entries = [decoded(decoder, files.sequence, tmp_path / name, box=(0, 0, 0, 7, 7, 7), layers=1)
               for name, decoder in DECODERS.items()]
    assert [content(entries[0].first)] == [content(entries[1].first)]


@pytest.mark.parametrize("kind", ["sequence", "numbered"])
def test_a_range_without_frames_fails(files, tmp_path, decoder, kind):
    with pytest.raises(jobs.JobFailed, match="frames"):
        decoded(decoder, getattr(files, kind), tmp_path / "cache", frames=(11, 12))


def test_a_damaged_file_fails_with_the_text_of_the_decoder(files, tmp_path, decoder):
    with pytest.raises(jobs.JobFailed, match="damaged.esvr"):
        decoded(decoder, files.damaged, tmp_path)
    assert os.listdir(tmp_path) == []


def test_a_damaged_frame_fails_and_leaves_nothing(files, tmp_path, decoder):
    for frame in FRAMES:
        (tmp_path / f"d{frame:02d}.esvr").write_bytes((files.folder / f"n.{frame:04d}.esvr").read_bytes())
    (tmp_path / "d08.esvr").write_bytes(b"nonsense")
    with pytest.raises(jobs.JobFailed, match="d08.esvr"):
        decoded(decoder, tmp_path / "d##.esvr", tmp_path / "cache")
    assert os.listdir(tmp_path / "cache") == []


def test_a_missing_file_fails(tmp_path, decoder):
    with pytest.raises(jobs.JobFailed, match="none.esvr"):
        decoded(decoder, tmp_path / "none.esvr", tmp_path)


def test_a_cache_that_cannot_be_written_fails(files, tmp_path, decoder):
    (tmp_path / "cache").write_text("a file, not a folder")
    with pytest.raises(jobs.JobFailed, match="cache"):
        decoded(decoder, files.file, tmp_path / "cache")


class Interrupted(ProgramDecoder):
    """Does something in the middle of a job."""

    def __init__(self, act):
        super().__init__(Programs.esvr2vdb)
        self._act = act

    def decode_file(self, job, path, settings, output):
        super().decode_file(job, path, settings, output)
        self._act(job, path)
        job.report(1.0, "")


def test_a_cancelled_job_leaves_nothing(files, tmp_path):
    with pytest.raises(jobs.Cancelled):
        decoded(Interrupted(lambda job, path: job.cancel()), files.file, tmp_path)
    assert os.listdir(tmp_path) == []


def test_a_source_that_changes_meanwhile_is_not_kept(files, tmp_path):
    path = tmp_path / "smoke.esvr"
    path.write_bytes(files.file.read_bytes())
    with pytest.raises(jobs.JobFailed, match="changed"):
        decoded(Interrupted(lambda job, path: os.utime(path, (1, 1))), path, tmp_path / "cache")
    assert os.listdir(tmp_path / "cache") == []
