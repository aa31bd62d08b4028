"""Every option of the programs has a test that shows its effect; a table names it. The tests here are of options that no other
test uses."""
import os
import pathlib
import re
import subprocess

import numpy as np
import pytest

from esvr.images import image2vdb, vdb2image

from conversions import convert, ramp, run, run_here

COMMON = {"--threads": "test_threads_and_messages", "--quiet": "test_threads_and_messages", "--verbose": "test_threads_and_messages",
          "--help": "test_help_fits_on_a_screen", "--version": "test_threads_and_messages"}
TESTS = {
    image2vdb: {"--name": "test_names_thresholds_and_backgrounds", "--threshold": "test_names_thresholds_and_backgrounds",
                "--background": "test_names_thresholds_and_backgrounds", "--channel": "test_imagej_hyperstack_by_tifffile",
                "--time": "test_the_program_writes_frames_and_channels", "--dataset": "test_arrays_of_vti",
                "--axes": "test_axes_without_names_of_hdf5", "--stored": "test_missing_values_of_netcdf",
                "--as": "test_doubles_hold_larger_integers_and_fill_values_do_not_count",
                "--unit": "test_units_are_millimetres_or_what_is_asked", "--voxel-size": "test_gaps_are_named",
                "--nonfinite": "test_voxels_that_are_not_finite", "--normalise": "test_values_up_to_one",
                "--dims": "test_raw_by_struct", "--type": "test_raw_by_struct", "--endian": "test_raw_by_struct",
                "--skip": "test_raw_by_struct", "--max-memory": "test_memory_is_limited",
                "--force": "test_outputs_are_replaced_only_by_force", **COMMON},
    vdb2image: {"--grid": "test_grids_are_chosen_and_boxes_follow_voxels", "--frame": "test_frames_of_one_file_of_esvr",
                "--type": "test_what_a_format_cannot_hold", "--unit": "test_units_and_memory_on_the_way_back",
                "--max-memory": "test_units_and_memory_on_the_way_back", "--force": "test_units_and_memory_on_the_way_back", **COMMON}}


@pytest.mark.parametrize("module", TESTS)
def test_every_option_has_a_test(module):
    options = {option.option_strings[-1]: option.option_strings[0] for option in module.PARSER.options}
    assert set(TESTS[module]) == set(options)
    source = "\n".join(path.read_text() for path in sorted(pathlib.Path(__file__).parent.glob("test_*.py")))
    for option, test in TESTS[module].items():
        body = re.search(rf"^def {test}\(.*?(?=^\S|\Z)", source, re.MULTILINE | re.DOTALL)
        assert body, f"{option}: there is no {test}"
        assert f'"{option}"' in body[0] or f'"{options[option]}"' in body[0], f"{test} does not use {option}"


def test_names_thresholds_and_backgrounds(tmp_path):
    np.save(tmp_path / "a.npy", ramp())
    made = convert(tmp_path / "a.npy", "--name", "dose", "--threshold", 300)
    assert made.grid.name == "dose" and made.grid.active_voxels == 30
    made = convert(tmp_path / "a.npy", "--background", 1)
    assert made.grid.background == 1 and made.grid.active_voxels == 119 and not made.active[0, 0, 0]


def test_values_up_to_one(tmp_path):
    np.save(tmp_path / "a.npy", ramp())
    assert np.allclose(convert(tmp_path / "a.npy", "--normalise").values, ramp() / 65535)
    np.save(tmp_path / "b.npy", ramp("f4"))
    made = convert(tmp_path / "b.npy", "--normalise", "--threshold", 301)
    assert np.allclose(made.values[made.active], ramp()[3].ravel() / 346)


def test_threads_and_messages(tmp_path):
    np.save(tmp_path / "a.npy", ramp())
    words = ["image2vdb", tmp_path / "a.npy", tmp_path / "o.vdb", "-f"]
    done = run(*words, "--threads", 1)
    assert done.returncode == 0 and "120 active voxels" in done.stderr
    assert run(*words, "--quiet").stderr == ""
    done = run("image2vdb", tmp_path / "none.npy", tmp_path / "p.vdb", "--verbose")
    assert done.returncode == 3 and "BadInput" in done.stderr  # the place in the code, for reports of faults
    assert run("vdb2image", "--version").stdout.startswith("vdb2image ")


def test_frames_of_one_file_of_esvr(tmp_path):
    encoder = pathlib.Path(os.environ.get("ESVR_BIN", "/nowhere")) / "vdb2esvr/vdb2esvr"
    if not encoder.is_file():
        pytest.skip("ESVR_BIN has no vdb2esvr")
    np.save(tmp_path / "a.npy", np.stack([ramp(), ramp() + 1000]))
    assert run_here(image2vdb, tmp_path / "a.npy", tmp_path / "o.##.vdb", "--axes", "tzyx", "--time", "all") == 0
    subprocess.run([str(encoder), str(tmp_path / "o.##.vdb"), str(tmp_path / "a.esvr"), "--lossless", "--device", "cpu", "-q"],
                   check=True)
    assert run_here(vdb2image, tmp_path / "a.esvr", tmp_path / "b.npy", "--frame", 1) == 0
    assert np.array_equal(np.load(tmp_path / "b.npy"), ramp() + 1000)


def test_units_and_memory_on_the_way_back(tmp_path, capfd):
    np.save(tmp_path / "a.npy", ramp())
    assert run_here(image2vdb, tmp_path / "a.npy", tmp_path / "a.vdb", "--voxel-size", "1", "--unit", "cm") == 0
    assert run_here(vdb2image, tmp_path / "a.vdb", tmp_path / "b.nrrd", "--unit", "um") == 0
    made = convert(tmp_path / "b.nrrd", "--unit", "mm")
    assert np.allclose(made.spacing, 10) and made.unit == "mm"
    assert run_here(vdb2image, tmp_path / "a.vdb", tmp_path / "b.nrrd", "--force") == 0
    assert run_here(vdb2image, tmp_path / "a.vdb", tmp_path / "c.nrrd", "--max-memory", "100") == 5
    assert "c.nrrd" not in os.listdir(tmp_path)
