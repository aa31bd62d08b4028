"""The examples of samples/notebooks run, on real volumes where there are any, and on samples otherwise."""
import os
import pathlib
import subprocess
import sys

import pytest

import esvr

EXAMPLES = pathlib.Path(os.environ.get("ESVR_DOCS", "docs")).parent / "samples/notebooks"
REAL = {"effects_td": "fire/fluid_data_0060.vdb", "radiologist": "aneurism.vdb", "weather_scientist": "wdas_cloud_sixteenth.vdb"}
SAMPLES = {"effects_td": "plume", "radiologist": "tree", "weather_scientist": "plume"}


@pytest.mark.parametrize("name", sorted(path.stem for path in EXAMPLES.glob("*.py")))
@pytest.mark.parametrize("real", [False, True])
def test_example_runs(name, real, tmp_path, request):
    if name == "weather_scientist":
        pytest.importorskip("xarray")
    if real:
        source = request.getfixturevalue("data") / REAL[name]
    elif "ESVR_BIN" in os.environ:
        source = tmp_path / "in.vdb"
        subprocess.run([f"{os.environ['ESVR_BIN']}/samples/esvr-sample", SAMPLES[name], source, "--resolution", "32", "--quiet"],
                       check=True)
    else:
        pytest.skip("there is no esvr-sample")
    package = pathlib.Path(esvr.__file__).parent.parent
    run = subprocess.run([sys.executable, "-W", "error::UserWarning", EXAMPLES / f"{name}.py", source], cwd=tmp_path, text=True,
                         capture_output=True, env={**os.environ, "PYTHONPATH": str(package)})
    assert run.returncode == 0, run.stdout + run.stderr
    assert "<esvr." in run.stdout
