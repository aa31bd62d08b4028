"""The add-on in Blender: what it imports is what the .vdb files of esvr2vdb would be, and it follows changes.

The add-on is installed as a zip file into a fresh folder of scripts. The steps of all tests but one run in one Blender
without a window, because its start takes longer than most of them; each step begins with the factory settings.
"""
import json
import os
import pathlib
import shutil
import subprocess
import sys

import pytest
from conftest import BUILD, FRAMES, Programs

HERE = pathlib.Path(__file__).resolve().parent
PACK = HERE.parents[2] / "integrations/blender/pack.py"
RESULT = "result of the step: "  # begins the line with it (steps.py)


class Session:
    """A Blender into which the add-on was installed."""

    def __init__(self, folder):
        modules = os.pathsep.join([str(BUILD / "python"), os.environ.get("PYTHONPATH", "")])
        self.environment = {**os.environ, "PYTHONPATH": modules, "BLENDER_USER_SCRIPTS": str(folder / "scripts"),
                            "BLENDER_USER_CONFIG": str(folder / "config")}
        for name in ("scripts", "config"):
            (folder / name).mkdir()
        words = ["blender", "--background", "--factory-startup", "--python-exit-code", "1", "--python",
                 HERE / "steps.py"]
        self.process = subprocess.Popen(words, text=True, env=self.environment, stdin=subprocess.PIPE,
                                        stdout=subprocess.PIPE, stderr=subprocess.STDOUT)

    def run(self, step, arguments, home):
        """The result of a step. `home` is the folder of the user's cache."""
        request = {"step": step, "arguments": arguments, "home": home}
        self.process.stdin.write(json.dumps(request, default=str) + "\n")
        self.process.stdin.flush()
        said = []
        for line in self.process.stdout:
            if line.startswith(RESULT):
                return json.loads(line.removeprefix(RESULT))
            said.append(line)
        raise AssertionError("".join(said))

    def end(self):
        self.process.communicate(timeout=60)


class Blender:
    """What a test does in Blender, with a cache and preferences of its own."""

    def __init__(self, session, folder):
        self.session, self.folder = session, folder
        self.cache = folder / "decoded files"
        self.preferences = {"cache_place": "FOLDER", "cache_folder": str(self.cache), "decoder": "PROGRAM",
                            "esvr2vdb": Programs.esvr2vdb, "vdb2esvr": Programs.vdb2esvr}

    def run(self, step, preferences=(), **arguments):
        """The result of a step. `preferences` differ from those of the other steps."""
        arguments["preferences"] = {**self.preferences, **dict(preferences)}
        return self.session.run(step, arguments, self.folder / "home")

    def run_window(self, **arguments):
        """The result of window_steps.py, whose window is kept in memory."""
        words, result = self.folder / "arguments.json", self.folder / "result.json"
        words.write_text(json.dumps({"preferences": self.preferences, **arguments}, default=str))
        done = subprocess.run(["xvfb-run", "-a", "-s", "-screen 0 1024x768x24", "blender", "--factory-startup",
                               "--enable-event-simulate", "--python-exit-code", "1", "--python",
                               HERE / "window_steps.py", "--", words, result], text=True,
                              env={**self.session.environment, "XDG_CACHE_HOME": str(self.folder / "home")},
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=300)
        assert result.exists(), done.stdout
        return json.loads(result.read_text())


@pytest.fixture(scope="session")
def session(tmp_path_factory):
    """A Blender with the add-on, as its installer leaves it."""
    folder = tmp_path_factory.mktemp("installed")
    subprocess.run([sys.executable, PACK, folder / "esvr_blender.zip"], check=True)
    started = Session(folder)
    installed = started.run("install", {"zip_file": folder / "esvr_blender.zip"}, folder / "home")
    assert installed == {"menu": False, "property": False}
    yield started
    started.end()


@pytest.fixture
def blender(session, tmp_path):
    return Blender(session, tmp_path)


@pytest.fixture
def vdb(files, tmp_path):
    """What esvr2vdb makes of the file."""
    Programs.run(Programs.esvr2vdb, files.file, tmp_path / "direct.vdb")
    return tmp_path / "direct.vdb"


def names_in(facts):
    return [grid["name"] for grid in facts["grids"]]


def test_the_zip_file_has_the_same_bytes_each_time_and_a_licence(tmp_path):
    for name in ("a.zip", "b.zip"):
        subprocess.run([sys.executable, PACK, tmp_path / name], check=True)
    assert (tmp_path / "a.zip").read_bytes() == (tmp_path / "b.zip").read_bytes()
    shutil.unpack_archive(tmp_path / "a.zip", tmp_path / "content")
    assert [entry.name for entry in (tmp_path / "content").iterdir()] == ["esvr_blender"]
    folder = tmp_path / "content/esvr_blender"
    assert "GNU GENERAL PUBLIC LICENSE" in (folder / "LICENSE").read_text()
    assert {"__init__.py", "blender_manifest.toml"} <= {path.name for path in folder.iterdir()}


@pytest.mark.parametrize("decoder", ["PROGRAM", "MODULE"])
def test_an_import_shows_what_the_vdb_file_shows(blender, files, vdb, decoder):
    result = blender.run("facts", {"decoder": decoder}, esvr=files.file, vdb=vdb, options={})
    assert result["esvr"] == result["vdb"]
    assert names_in(result["esvr"]) == ["density", "temperature"] and result["esvr"]["error"] == ""
    assert any(grid["surface"] for grid in result["esvr"]["grids"])
    assert result["shown"]["source"] == str(files.file) and result["shown"]["name"] == "two words"
    assert result["shown"]["file"].startswith(str(blender.cache))


def test_a_volume_of_houdini_is_turned(blender, data, tmp_path):
    Programs.run(Programs.vdb2esvr, data / "smoke1.vdb", tmp_path / "smoke1.esvr", "--preset", "draft",
                 "--representation", "voxels")
    Programs.run(Programs.esvr2vdb, tmp_path / "smoke1.esvr", tmp_path / "direct.vdb")
    result = blender.run("facts", esvr=tmp_path / "smoke1.esvr", vdb=tmp_path / "direct.vdb", options={})
    assert result["esvr"] == result["vdb"]
    assert result["esvr"]["matrix_world"][1][1] == pytest.approx(0.0, abs=1e-6)


def test_a_picture_is_that_of_the_vdb_file(blender, files, tmp_path):
    plume, direct = files.folder / f"n.{FRAMES[-1]:04d}.esvr", tmp_path / "direct.vdb"
    Programs.run(Programs.esvr2vdb, plume, direct)
    first, second = (blender.run("picture", shown=shown, camera_of=direct, output=tmp_path / f"{shown.name}.exr")
                     for shown in (direct, plume))
    assert first == second and max(first) > 0.5


def test_part_of_a_file_is_imported(blender, files, tmp_path):
    part = ["--bbox", "3,3,3,12,12,12", "--max-ellipsoids", "30"]
    Programs.run(Programs.esvr2vdb, files.file, tmp_path / "part.vdb", *part)
    options = {"use_box": True, "box_min": (3, 3, 3), "box_max": (12, 12, 12), "max_ellipsoids": 30}
    result = blender.run("facts", esvr=files.file, vdb=tmp_path / "part.vdb", options=options)
    assert result["esvr"] == result["vdb"]


@pytest.mark.parametrize("decoder", ["PROGRAM", "MODULE"])
def test_a_sequence_in_one_file_shows_its_frames(blender, files, tmp_path, decoder):
    # Blender's own import takes the numbers of the first and the last frame, and those in between.
    subprocess.run([Programs.esvr2vdb, files.sequence, "x_####.vdb"], cwd=tmp_path, check=True)
    result = blender.run("facts", {"decoder": decoder}, esvr=files.sequence, vdb=tmp_path / "x_####.vdb", options={})
    sequence, direct = result["esvr"]["sequence"], result["vdb"]["sequence"]
    assert sequence["is_sequence"] and sequence["frame_start"] == 1
    assert sequence["frame_offset"] == FRAMES[0] - 1 and sequence["frame_duration"] == FRAMES[-1] - FRAMES[0] + 1
    assert [frame["file"] for frame in sequence["frames"]][:2] == ["all_frames_0007.vdb", "all_frames_0008.vdb"]
    boxes = [[frame["bound_box"] for frame in s["frames"] if not frame["error"]] for s in (sequence, direct)]
    assert boxes[0] == boxes[1] and len(boxes[0]) >= 2 and boxes[0][0] != boxes[0][1]


def test_numbered_files_that_are_chosen_together_are_a_sequence(blender, files):
    names = ["n.0007.esvr", "n.0008.esvr", "two words.esvr"]
    result = blender.run("chosen_files", folder=f"{files.folder}/", names=names)
    sequence, single = sorted(result, key=lambda volume: volume["name"])
    assert sequence["source"] == files.numbered and sequence["sequence"]["frame_duration"] == 2
    assert [frame["error"] for frame in sequence["sequence"]["frames"]] == ["", ""]
    assert not single["is_sequence"] and single["source"] == str(files.file)


def test_changed_settings_decode_again(blender, files):
    box = {"use_box": True, "box_min": (0, 0, 0), "box_max": (7, 7, 7)}
    result = blender.run("change", esvr=files.file, settings=box)
    assert result["unchanged"] == result["before"]["file"] != result["after"]["file"] and result["error"] == ""
    assert result["after"]["dimensions"] != result["before"]["dimensions"]
    assert names_in(result["after"]) == names_in(result["before"])


def test_settings_that_cannot_be_decoded_leave_the_volume(blender, files):
    box = {"use_box": True, "box_min": (9, 0, 0), "box_max": (7, 7, 7)}
    result = blender.run("change", esvr=files.file, settings=box)
    assert "empty" in result["error"] or "box" in result["error"]
    assert result["after"]["file"] == result["before"]["file"] and result["after"]["grids"]


def test_a_source_that_changed_is_decoded_when_the_file_is_opened(blender, files, tmp_path):
    esvr, other = tmp_path / "smoke.esvr", tmp_path / "other.esvr"
    esvr.write_bytes(files.file.read_bytes())
    other.write_bytes((files.folder / "n.0007.esvr").read_bytes())
    result = blender.run("open_again", {"cache_place": "BLEND"}, esvr=esvr, other=other, blend=tmp_path / "scene.blend")
    assert result["before"]["stored"].startswith("//esvr_cache/") and result["before"]["source"] == "//smoke.esvr"
    assert names_in(result["before"]) == ["density", "temperature"] and names_in(result["after"]) == ["density"]


def test_without_its_source_a_file_opens_and_shows_what_was_decoded(blender, files, tmp_path):
    esvr = tmp_path / "smoke.esvr"
    esvr.write_bytes(files.file.read_bytes())
    result = blender.run("open_without_source", esvr=esvr, blend=tmp_path / "scene.blend")
    assert result["grids"] == 2 and "smoke.esvr: there is no such file" in result["error"]


def test_before_the_first_save_files_are_in_the_cache_of_the_user(blender, files, vdb, tmp_path):
    result = blender.run("facts", {"cache_place": "BLEND"}, esvr=files.file, vdb=vdb, options={})
    assert result["shown"]["file"].startswith(str(tmp_path / "home/esvr_blender"))


@pytest.mark.parametrize("options", [{}, {"goal": "LOSSLESS"},
                                     {"goal": "MAX_ERROR", "max_error": 2.0, "topology": "exact"}])
def test_an_export_gives_a_file(blender, files, tmp_path, options):
    output = tmp_path / "ein Würfel.esvr"
    assert blender.run("export", vdb=files.vdb, esvr=output, options=options) == {"error": ""}
    listed = Programs.run(Programs.esvr2vdb, "--list", output)
    assert "density" in listed and "temperature" in listed
    Programs.run(Programs.esvr2vdb, "--check", output)


def test_an_export_of_a_sequence_gives_one_file(blender, files, tmp_path):
    pattern = files.folder / "s_####.vdb"
    frames = FRAMES[-1] - FRAMES[0] + 1
    assert blender.run("export", vdb=pattern, esvr=tmp_path / "a.esvr", options={}, frames=frames) == {"error": ""}
    assert f"{len(FRAMES)} frames" in Programs.run(Programs.esvr2vdb, "--list", tmp_path / "a.esvr")


def test_a_volume_without_a_file_is_not_exported(blender, tmp_path):
    assert "no .vdb file" in blender.run("export_nothing", esvr=tmp_path / "a.esvr")["error"]


def test_a_damaged_file_is_an_error_with_the_text_of_the_program(blender, files):
    result = blender.run("refused", esvr=files.damaged)
    assert "damaged.esvr" in result["error"] and result["volumes"] == 0
    assert os.listdir(blender.cache) == []


def test_a_missing_program_is_an_error_that_names_it(blender, files, tmp_path):
    missing = {"esvr2vdb": "/no/such/esvr2vdb", "vdb2esvr": "/no/such/vdb2esvr"}
    result = blender.run("refused", missing, esvr=files.file)
    assert "/no/such/esvr2vdb" in result["error"] and result["volumes"] == 0
    result = blender.run("export", missing, vdb=files.vdb, esvr=tmp_path / "a.esvr", options={})
    assert "/no/such/vdb2esvr" in result["error"]


def test_clearing_the_cache_keeps_what_is_shown(blender, files):
    assert blender.run("clear", esvr=files.file) == {"first": False, "second": True}


def test_in_a_window_changes_are_decoded_and_escape_cancels(blender, files, tmp_path):
    slow = tmp_path / "slow program"
    slow.write_text(f"#!{sys.executable}\nimport time\ntime.sleep(60)\n")
    slow.chmod(0o755)
    result = blender.run_window(esvr=files.file, slow=slow)
    assert result["import"] == ["RUNNING_MODAL"]
    assert result["first"] != result["second"] == result["third"]
    assert result["text"] == "Decoding two words"
    assert "two words.esvr.missing: there is no such file" in result["error"]


def test_a_disabled_add_on_leaves_nothing(blender):
    result = blender.run("unregister")
    assert result["left"] == [] and not result["property"]
    assert not any("esvr" in module for module in result["handlers"])
