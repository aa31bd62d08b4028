"""Every example of docs/python.md runs, in its order, in an empty folder.

The example with grids of OpenVDB's Python module is left out where that is missing.
"""
import importlib.util
import os
import pathlib
import re

import esvr
from esvr import _openvdb


def has_openvdb():
    return any(importlib.util.find_spec(name) for name in _openvdb.MODULES)


def test_examples_run(tmp_path, monkeypatch, volume):
    monkeypatch.chdir(tmp_path)
    volume.save("smoke.vdb")
    text = (pathlib.Path(os.environ["ESVR_DOCS"]) / "python.md").read_text()
    examples = re.findall(r"^```python\n(.*?)^```", text, flags=re.DOTALL | re.MULTILINE)
    assert len(examples) > 5
    names = {}
    for example in examples:
        if "to_pyopenvdb" in example and not has_openvdb():
            continue
        exec(compile(example, "docs/python.md", "exec"), names)
    assert esvr.read("smoke.esvr")
