"""Both decoders write the voxels that esvr2vdb writes, and nothing else remains in the cache. Each goal of an export gives a
file; failed and cancelled exports leave what was there."""
import os
import subprocess
import sys

import esvr
import pytest
from conftest import FRAMES, Programs
from esvr_blender import cache, jobs
from esvr_blender.decode import ModuleDecoder, ProgramDecoder, Request, decode
from esvr_blender.export import Export, Goal, Input, export
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


# Export.


def exported(program, source, output, goal=Goal(), **options):
    job = jobs.Job(lambda job: export(job, Export(program, source, str(output), goal, **options)))
    job.run()
    if job.error:
        raise job.error
    return job.result


@pytest.mark.parametrize("goal", [Goal(), Goal("--preset", "draft"), Goal("--psnr", "30"), Goal("--max-error", "5%"),
                                  Goal("--size", "3000"), Goal("--ratio", "10"), Goal("--lossless")])
def test_every_goal_gives_a_file(files, programs, tmp_path, goal):
    output = tmp_path / "a b#.esvr"
    exported(programs.vdb2esvr, Input(str(files.folder / "s_0007.vdb")), output, goal)
    assert [grid.name for grid in esvr.read(output).grids] == ["density"]
    assert os.listdir(tmp_path) == [output.name]


def test_topology_and_representation_are_options(files, programs, tmp_path):
    source = files.folder / "s_0010.vdb"
    for representation in ("voxels", "ellipsoids"):
        output = tmp_path / f"{representation}.esvr"
        exported(programs.vdb2esvr, Input(str(source)), output, topology="exact", representation=representation)
        grid = esvr.read(output).grids[0]
        assert grid.kind == representation and esvr.compare(esvr.Volume.from_vdb(source), grid).iou == 1.0


def test_a_sequence_becomes_one_file(files, programs, tmp_path):
    exported(programs.vdb2esvr, Input(str(files.folder / "s_0007.vdb"), (8, 10)), tmp_path / "a.esvr")
    assert esvr.frames(tmp_path / "a.esvr") == [8, 10]
    assert FRAMES == (7, 8, 10)  # 9 is missing


def test_a_file_that_is_there_is_replaced_only_by_a_complete_one(files, programs, tmp_path):
    output, damaged = tmp_path / "a.esvr", tmp_path / "damaged.vdb"
    output.write_text("old")
    damaged.write_bytes(files.vdb.read_bytes()[:1000])
    with pytest.raises(jobs.JobFailed, match="damaged.vdb"):
        exported(programs.vdb2esvr, Input(str(damaged)), output)
    assert output.read_text() == "old" and sorted(os.listdir(tmp_path)) == ["a.esvr", "damaged.vdb"]
    exported(programs.vdb2esvr, Input(str(files.folder / "s_0007.vdb")), output)
    assert esvr.read(output)


def test_missing_files_are_named(programs, tmp_path):
    with pytest.raises(jobs.JobFailed, match="none.vdb"):
        exported(programs.vdb2esvr, Input(str(tmp_path / "none.vdb")), tmp_path / "a.esvr")
    with pytest.raises(jobs.JobFailed, match="none.vdb.*number"):
        exported(programs.vdb2esvr, Input(str(tmp_path / "none.vdb"), (1, 2)), tmp_path / "a.esvr")


def test_a_folder_that_cannot_be_written_is_named(files, programs, tmp_path):
    (tmp_path / "nowhere").write_text("a file, not a folder")
    with pytest.raises(jobs.JobFailed, match="nowhere"):
        exported(programs.vdb2esvr, Input(str(files.vdb)), tmp_path / "nowhere/a.esvr")


def script(tmp_path, code):
    """A program that stands for vdb2esvr."""
    path = tmp_path / "program"
    path.write_text(f"#!{sys.executable}\nimport sys, time\n{code}\n")
    path.chmod(0o755)
    return str(path)


def test_a_target_that_is_missed_is_a_warning(files, tmp_path):
    program = script(tmp_path, "open('out.esvr', 'w').write('new')\n"
                     "print('vdb2esvr: warning: reached 3 dB', file=sys.stderr); sys.exit(4)")
    assert "3 dB" in exported(program, Input(str(files.vdb)), tmp_path / "a.esvr")
    assert (tmp_path / "a.esvr").read_text() == "new"


def test_progress_is_told_and_a_cancelled_export_leaves_nothing(files, tmp_path):
    program = script(tmp_path, "open('out.esvr', 'w').write('half')\n"
                     """print('{"grid":"density","fraction":0.25}', file=sys.stderr, flush=True); time.sleep(60)""")
    output = tmp_path / "a.esvr"
    job = jobs.Job(lambda job: export(job, Export(program, Input(str(files.vdb)), str(output), Goal())))
    job.start()
    while job.fraction == 0.0 and not job.is_done:
        pass
    assert (job.fraction, job.text) == (0.25, "Converting density")
    job.cancel()
    job.wait()
    assert isinstance(job.error, jobs.Cancelled) and os.listdir(tmp_path) == ["program"]
