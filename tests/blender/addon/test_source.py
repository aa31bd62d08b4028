"""A source is a file or a pattern; chosen files become sources; what is missing is named."""
import os

import pytest
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
