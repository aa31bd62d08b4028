"""Names of cached folders follow from everything that decides about their content, and folders are complete or not there."""
import os

import pytest
from esvr_blender import cache
from esvr_blender.cache import Settings
from esvr_blender.source import Source


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
