"""The manifest follows the rules of Blender's documentation, and agrees with bl_info and the version of the project."""
import pathlib
import re
import tomllib

import esvr
import esvr_blender

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
