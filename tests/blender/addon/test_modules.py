"""The modules of the add-on without bpy: sources, the cache, jobs and the manifest."""
import os
import pathlib
import re
import sys
import time
import tomllib

import pytest

import esvr
import esvr_blender
from esvr_blender import cache
from esvr_blender.cache import Settings
from esvr_blender.jobs import Cancelled, Job, JobFailed, find_program
from esvr_blender.source import Source
from esvr_blender.source import Source, SourceError, gaps_in, grouped, text_of_gaps


def touch(folder, *names):
    for name in names:
        (folder / name).touch()


def test_a_file_is_one_source(tmp_path):
    touch(tmp_path, "smoke.esvr")
    source = Source(str(tmp_path / "smoke.esvr"))
    assert source.files() == {None: source.text} and source.stem == "smoke"


def test_a_pattern_has_the_files_of_its_very_names(tmp_path):
    touch(tmp_path, "s.0007.esvr", "s.0010.esvr", "s.12345.esvr")
    touch(tmp_path, "s.9.esvr", "s.00011.esvr", "s.0012.esvr.bak", "s.-003.esvr")  # of other patterns
    source = Source(str(tmp_path / "s.####.esvr"))
    assert list(source.files()) == [7, 10, 12345]
    assert source.files((8, 100)) == {10: str(tmp_path / "s.0010.esvr")}
    assert source.stem == "s"


def test_files_that_look_like_frames_are_named(tmp_path):
    touch(tmp_path, "s.0007.esvr", "s.0010.esvr", "s.0010.txt", "t.1.esvr", "s.a.esvr")
    source = Source(str(tmp_path / "s.####.esvr"))
    assert source.hint() == ""
    touch(tmp_path, "s.9.esvr", "s.-003.esvr", "s.0008.50.esvr")
    assert "s.-003.esvr and 2 more" in source.hint()
    assert "s.9.esvr looked" in source.hint((9, 10)) and source.hint((10, 20)) == ""
    assert Source(str(tmp_path / "s.9.esvr")).hint() == ""


@pytest.mark.parametrize("pattern, name", [("s#.esvr", "s0003.esvr"), ("s@.esvr", "s3.esvr"), ("s@@.esvr", "s03.esvr"),
                                           ("s##.esvr", "s03.esvr")])
def test_patterns_mean_what_they_mean_to_the_programs(tmp_path, pattern, name):
    touch(tmp_path, name)
    assert Source(str(tmp_path / pattern)).files() == {3: str(tmp_path / name)}


def test_a_file_whose_name_looks_like_a_pattern_is_a_file(tmp_path):
    touch(tmp_path, "take#2.esvr", "take0002.esvr")
    source = Source(str(tmp_path / "take#2.esvr"))
    assert not source.is_numbered and source.files() == {None: source.text}


@pytest.mark.parametrize("name", ["none.esvr", "none.####.esvr"])
def test_missing_files_are_named(tmp_path, name):
    with pytest.raises(SourceError, match=name):
        Source(str(tmp_path / name)).files()


def test_a_range_without_files_is_named(tmp_path):
    touch(tmp_path, "s.0007.esvr")
    with pytest.raises(SourceError, match="frames 8 to 9"):
        Source(str(tmp_path / "s.####.esvr")).files((8, 9))


def group(tmp_path, *names):
    found = grouped(tmp_path / name for name in names)
    return [(os.path.relpath(source.text, tmp_path), frames) for source, frames in found]


def test_chosen_files_that_differ_in_their_number_are_a_sequence(tmp_path):
    assert group(tmp_path, "a1.0007.esvr", "b.esvr", "a1.0009.esvr", "c_1.esvr") == [
        ("a1.####.esvr", (7, 9)), ("b.esvr", None), ("c_1.esvr", None)]


def test_numbers_of_different_lengths_have_the_pattern_of_the_shortest(tmp_path):
    assert group(tmp_path, "a10.esvr", "a9.esvr") == [("a@.esvr", (9, 10))]
    assert group(tmp_path, "a100.esvr", "a99.esvr") == [("a##.esvr", (99, 100))]


def test_names_that_would_become_another_pattern_are_no_sequence(tmp_path):
    assert group(tmp_path, "a1#.esvr", "a2#.esvr") == [("a1#.esvr", None), ("a2#.esvr", None)]


def test_gaps_between_frames_are_told():
    assert gaps_in([1, 2, 3]) == [] and gaps_in([]) == [] and gaps_in([7]) == []
    assert gaps_in([1, 2, 4, 9]) == [(3, 3), (5, 8)]
    assert text_of_gaps("smoke", [1, 2, 3]) == ""
    text = text_of_gaps("smoke", [1, 2, 4, 9])
    assert "smoke" in text and "3, 5 to 8" in text and "--missing hold" in text


@pytest.fixture
def source(tmp_path):
    path = tmp_path / "smoke.esvr"
    path.write_bytes(b"1234")
    return Source(str(path))


def test_the_identity_stays_while_nothing_changes(source):
    assert cache.identity_of(source, Settings()) == cache.identity_of(source, Settings())


def test_the_identity_follows_the_bytes_and_the_time_of_the_file(source):
    status = os.stat(source.text)
    first = cache.identity_of(source, Settings())
    os.utime(source.text, ns=(status.st_atime_ns, status.st_mtime_ns + 1000))
    touched = cache.identity_of(source, Settings())
    with open(source.text, "ab") as file:
        file.write(b"5")
    os.utime(source.text, ns=(status.st_atime_ns, status.st_mtime_ns))
    longer = cache.identity_of(source, Settings())
    assert len({first, touched, longer}) == 3


def test_the_identity_follows_the_path(source, tmp_path):
    other = Source(str(tmp_path / "other.esvr"))
    os.link(source.text, other.text)
    assert cache.identity_of(other, Settings()) != cache.identity_of(source, Settings())


def test_the_identity_follows_each_setting(source):
    settings = [Settings(), Settings(layers=1), Settings(max_ellipsoids=1), Settings(box=(0, 0, 0, 1, 1, 1)),
                Settings(frames=(1, 1)), Settings(frames=(1, 2))]
    assert len({cache.identity_of(source, s) for s in settings}) == len(settings)


def test_a_new_frame_changes_the_identity(tmp_path):
    (tmp_path / "s.0001.esvr").touch()
    source = Source(str(tmp_path / "s.####.esvr"))
    before = cache.identity_of(source, Settings())
    (tmp_path / "s.0002.esvr").touch()
    assert cache.identity_of(source, Settings()) != before


@pytest.mark.parametrize("stem, name", [("smoke", "smoke.vdb"), ("take#2", "take_2.vdb"), ("a b", "a_b.vdb"),
                                        ("-x", "x.vdb"), ("$F4", "F4.vdb"), ("@", "volume.vdb"), ("", "volume.vdb"),
                                        ("Büro", "Büro.vdb"), ("%04d", "04d.vdb"), ("x" * 300, "x" * 60 + ".vdb")])
def test_names_are_neither_patterns_nor_options(stem, name):
    assert cache.name_of(stem, None) == name


def test_names_of_frames_have_the_number_last():
    assert [cache.name_of("s", frame) for frame in (7, 12345)] == ["s_0007.vdb", "s_12345.vdb"]
    assert cache.pattern_of("s") == "s_####.vdb"


def fill(root, source, names, folder):
    with cache.unfinished(root) as work:
        for name in names.values():
            with open(os.path.join(work, name), "w"):
                pass
        return cache.complete(work, folder, names, source)


def test_a_complete_folder_is_found_with_its_files(source, tmp_path):
    root = str(tmp_path / "cache")
    folder = cache.folder_of(root, source, "0123")
    names = {7: "s_0007.vdb", 9: "s_0009.vdb"}
    made = fill(root, source, names, folder)
    assert cache.entry_in(folder) == made and made.first == os.path.join(folder, "s_0007.vdb")
    assert os.listdir(root) == [os.path.basename(folder)]


def test_a_folder_without_one_of_its_files_is_not_complete(source, tmp_path):
    folder = str(tmp_path / "entry")
    made = fill(str(tmp_path), source, {None: "s.vdb"}, folder)
    os.remove(made.first)
    assert cache.entry_in(folder) is None
    assert fill(str(tmp_path), source, {None: "s.vdb"}, folder) == cache.entry_in(folder)


@pytest.mark.parametrize("text", ["", "{", "[]", '{"files": 3}', '{"files": []}'])
def test_a_damaged_record_is_no_entry(tmp_path, text):
    (tmp_path / cache.RECORD).write_text(text)
    assert cache.entry_in(str(tmp_path)) is None


def test_unfinished_folders_do_not_remain(tmp_path):
    with pytest.raises(LookupError):
        with cache.unfinished(str(tmp_path)) as work:
            open(os.path.join(work, "half.vdb"), "w").close()
            raise LookupError()
    assert os.listdir(tmp_path) == []


def test_clearing_keeps_what_is_used_and_what_is_not_of_the_cache(source, tmp_path):
    root = tmp_path / "cache"
    used = fill(str(root), source, {None: "s.vdb"}, str(root / "used"))
    fill(str(root), source, {None: "s.vdb"}, str(root / "old"))
    (root / "photos").mkdir()
    assert cache.remove_others(str(root), [used.folder]) == 1
    assert sorted(os.listdir(root)) == ["photos", "used"]


PROMPT = 10.0  # seconds, far below the sleep of the program


def finished(work):
    job = Job(work)
    job.start()
    job.wait()
    assert job.is_done
    return job


def test_a_job_keeps_its_result():
    assert finished(lambda job: 5).result == 5


def test_a_job_keeps_its_error():
    def work(job):
        raise JobFailed("no")
    assert str(finished(work).error) == "no"


def python(code):
    return lambda job: job.run_program([sys.executable, "-c", code], os.getcwd())


def test_the_text_of_a_program_comes_back():
    assert finished(python("import sys; sys.stdout.buffer.write('böse'.encode())")).result == "böse"
    assert finished(python("import sys; sys.stdout.buffer.write(bytes([255]))")).result == "\ufffd"


def test_the_text_is_seen_while_the_program_runs_and_is_whole_afterwards():
    code = "import time\nfor i in range(20): print('line', i, flush=True); time.sleep(0.02)"
    seen = []
    job = finished(lambda job: job.run_program([sys.executable, "-c", code], os.getcwd(), seen.append))
    assert job.result.splitlines() == [f"line {i}" for i in range(20)]
    assert any(0 < len(text.splitlines()) < 20 for text in seen)


def test_a_program_that_fails_tells_why():
    job = finished(python("import sys; print('{}'); sys.exit('the reason')"))
    assert isinstance(job.error, JobFailed) and str(job.error) == "the reason"


def test_a_program_that_fails_without_a_word_has_its_exit_code_told():
    assert "exit code 3" in str(finished(python("raise SystemExit(3)")).error)


@pytest.mark.parametrize("code", [
    "import time; time.sleep(60)",
    "import signal, time; signal.signal(signal.SIGTERM, signal.SIG_IGN); time.sleep(60)"])
def test_cancelling_ends_the_program(code):
    job = Job(python(code))
    start = time.monotonic()
    job.start()
    time.sleep(0.5)
    assert not job.is_done
    job.cancel()
    job.wait()
    assert isinstance(job.error, Cancelled) and time.monotonic() - start < PROMPT


def test_a_program_that_cannot_be_started_is_named():
    job = finished(lambda job: job.run_program(["/no/such/program"], os.getcwd()))
    assert "/no/such/program" in str(job.error)


def test_programs_are_found_in_the_path_and_at_their_path(tmp_path, monkeypatch):
    program = tmp_path / "esvr tool"
    program.write_text("#!/bin/sh\n")
    program.chmod(0o755)
    assert find_program("esvr2vdb", str(program)) == str(program)
    monkeypatch.setenv("PATH", str(tmp_path))
    assert find_program("esvr tool") == str(program)


@pytest.mark.parametrize("path", ["", "/no/such/esvr2vdb"])
def test_a_missing_program_is_named(tmp_path, monkeypatch, path):
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(JobFailed, match="esvr2vdb.*preferences"):
        find_program("esvr2vdb", path)


FOLDER = pathlib.Path(esvr_blender.__file__).resolve().parent
MANIFEST = tomllib.loads((FOLDER / "blender_manifest.toml").read_text())
LONGEST_TEXT = 64


def test_everything_that_is_required_is_there():
    assert MANIFEST["schema_version"] == "1.0.0" and MANIFEST["type"] == "add-on"
    assert MANIFEST["id"] == FOLDER.name and MANIFEST["name"] == esvr_blender.bl_info["name"]
    assert MANIFEST["maintainer"] and MANIFEST["license"] == ["SPDX:GPL-3.0-or-later"]
    assert MANIFEST["blender_version_min"] == "4.2.0"  # the first version with extensions


def test_short_texts_are_short_and_end_without_punctuation():
    for text in (MANIFEST["tagline"], MANIFEST["permissions"]["files"]):
        assert len(text) <= LONGEST_TEXT and text[-1].isalnum()


def test_the_versions_agree():
    assert MANIFEST["version"] == esvr.__version__ == ".".join(map(str, esvr_blender.bl_info["version"]))


def test_every_file_names_its_licence():
    for path in [*FOLDER.glob("*.py"), *FOLDER.glob("*.toml"), FOLDER.parent / "pack.py"]:
        assert "SPDX-License-Identifier: GPL-3.0-or-later" in path.read_text(), path


def test_names_are_those_that_blender_knows():
    assert re.fullmatch(r"[a-z][a-z0-9_]*[a-z0-9]", MANIFEST["id"]) and "__" not in MANIFEST["id"]
    assert re.fullmatch(r"\d+\.\d+\.\d+", MANIFEST["version"])
    assert set(MANIFEST["permissions"]) <= {"files", "network", "clipboard", "camera", "microphone"}
    assert set(MANIFEST["tags"]) <= {"Import-Export", "Render", "Pipeline", "Physics"}  # of Blender's list, those that fit
    required = {"schema_version", "id", "version", "name", "tagline", "maintainer", "type", "blender_version_min", "license"}
    assert required <= set(MANIFEST) <= required | {"tags", "permissions"}


def test_modules_find_each_other_wherever_blender_puts_them():
    """An extension is bl_ext.REPOSITORY.esvr_blender, so that imports are relative, and only the module of the decoder is not."""
    for path in FOLDER.glob("*.py"):
        assert not re.search(r"^\s*(?:from|import) esvr_blender", path.read_text(), re.MULTILINE), path
