"""Each goal gives a file; failed and cancelled exports leave what was there."""
import os
import sys

import esvr
import pytest
from conftest import FRAMES
from esvr_blender import jobs
from esvr_blender.export import Export, Goal, Input, export


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
