"""The examples of the documents run.

Those of docs/library.md run in their order in an empty folder; those with grids of OpenVDB's Python module and with arrays of
xarray are left out where these are missing. Those of samples/notebooks run on real volumes where there are any, and on samples.
"""
import importlib.util
import os
import pathlib
import re
import subprocess
import sys

import pytest

import esvr
from esvr import _openvdb

EXAMPLES = pathlib.Path(os.environ.get("ESVR_DOCS", "docs")).parent / "samples/notebooks"
REAL = {"effects_td": "fire/fluid_data_0060.vdb", "radiologist": "aneurism.vdb", "weather_scientist": "wdas_cloud_sixteenth.vdb"}
SAMPLES = {"effects_td": "plume", "radiologist": "tree", "weather_scientist": "plume"}


def has_openvdb():
    try:
        return bool(_openvdb.openvdb())
    except ImportError:
        return False


def test_examples_run(tmp_path, monkeypatch, volume):
    monkeypatch.chdir(tmp_path)
    volume.save("smoke.vdb")
    text = (pathlib.Path(os.environ["ESVR_DOCS"]) / "library.md").read_text()
    examples = re.findall(r"^```python\n(.*?)^```", text, flags=re.DOTALL | re.MULTILINE)
    assert len(examples) > 5
    names = {}
    for example in examples:
        if "to_pyopenvdb" in example and not has_openvdb():
            continue
        if "import xarray" in example and not importlib.util.find_spec("xarray"):
            continue
        exec(compile(example, "docs/library.md", "exec"), names)
    assert esvr.read("smoke.esvr")


@pytest.mark.parametrize("name", sorted(path.stem for path in EXAMPLES.glob("*.py")))
@pytest.mark.parametrize("real", [False, True])
def test_example_runs(name, real, tmp_path, request, run):
    if name == "weather_scientist":
        pytest.importorskip("xarray")
    if real:
        source = request.getfixturevalue("data") / REAL[name]
    else:
        source = tmp_path / "in.vdb"
        run("esvr-sample", SAMPLES[name], source, "--resolution", "32", "--quiet")
    package = pathlib.Path(esvr.__file__).parent.parent
    ran = subprocess.run([sys.executable, "-W", "error::UserWarning", EXAMPLES / f"{name}.py", source], cwd=tmp_path, text=True,
                         capture_output=True, env={**os.environ, "PYTHONPATH": str(package)})
    assert ran.returncode == 0, ran.stdout + ran.stderr
    assert "<esvr." in ran.stdout
