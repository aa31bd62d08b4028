"""The examples of the documents run, and the type stubs have the functions, classes, parameters and defaults of the module.

Those of docs/library.md run in their order in an empty folder; those with grids of OpenVDB's Python module and with arrays of
xarray are left out where these are missing. Those of samples/notebooks run on real volumes where there are any, and on samples.
"""
import ast
import importlib.util
import inspect
import os
import pathlib
import re
import subprocess
import sys

import pytest

import esvr
from esvr import _core, _openvdb


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


STUBS = ast.parse((pathlib.Path(esvr.__file__).parent / "_core.pyi").read_text())
INHERITED = {"Volume": "_Drawn", "Grid": "_Drawn"}
SPECIAL = ("__init__", "__getitem__", "__len__")


def parameters_of(arguments):
    """Name, kind and default of each parameter but self, as literals."""
    def default(node):
        value = None if node is None else ast.literal_eval(node)
        return tuple(value) if isinstance(value, list) else value
    before = len(arguments.args) - len(arguments.defaults)
    found = [(argument.arg, "positional", i >= before, default(arguments.defaults[i - before]) if i >= before else None)
             for i, argument in enumerate(arguments.args)]
    found += [(argument.arg, "keyword", node is not None, default(node))
              for argument, node in zip(arguments.kwonlyargs, arguments.kw_defaults)]
    return [parameter for parameter in found if parameter[0] != "self"]


def functions_in(body):
    """The parameters of the functions of a stub: lists of one list for each overload, and properties by None."""
    found = {}
    for node in body:
        if isinstance(node, ast.FunctionDef) and (node.name in SPECIAL or not node.name.startswith("_")):
            marks = {ast.unparse(mark) for mark in node.decorator_list}
            found.setdefault(node.name, []).append(None if "property" in marks else parameters_of(node.args))
    return found


def stub_class(name):
    node = next(node for node in STUBS.body if isinstance(node, ast.ClassDef) and node.name == name)
    base = functions_in(stub_class(INHERITED[name]).body) if name in INHERITED else {}
    node.functions = {**base, **functions_in(node.body)}
    return node


def signatures_of(function):
    """The parameters of a function of the module, by the text that pybind11 puts into its docstring, or by its own signature."""
    function = inspect.unwrap(function)  # of what explains wrong arguments
    if inspect.isfunction(function):
        found = parameters_of(ast.parse(f"def {function.__name__}{inspect.signature(function)}: ...").body[0].args)
        return [found]
    lines = [line for line in function.__doc__.splitlines() if re.match(rf"(\d+\. )?{function.__name__}\(", line)]
    if len(lines) > 1:
        lines = lines[1:]  # the first one is that of all overloads
    texts = [re.sub(r"^\d+\. ", "", line).rpartition(" -> ")[0] for line in lines]
    return [parameters_of(ast.parse(f"def {text}: ...").body[0].args) for text in texts]


def public(names):
    return {name for name in names if not name.startswith("_")}


CLASSES = sorted(name for name in public(vars(_core)) if inspect.isclass(getattr(_core, name)) and
                 not issubclass(getattr(_core, name), Exception))
FUNCTIONS = sorted(name for name in public(vars(_core)) if inspect.isroutine(getattr(_core, name)))


def test_the_stubs_name_what_there_is():
    classes = {node.name for node in STUBS.body if isinstance(node, ast.ClassDef)}
    assert public(classes) == {name for name in public(vars(_core)) if inspect.isclass(getattr(_core, name))}
    assert set(functions_in(STUBS.body)) == set(FUNCTIONS)
    assert set(esvr.__all__) == public(classes) | set(FUNCTIONS) | {"__version__"}


@pytest.mark.parametrize("name", FUNCTIONS)
def test_functions_are_those_of_the_stubs(name):
    assert functions_in(STUBS.body)[name] == signatures_of(getattr(_core, name))


@pytest.mark.parametrize("name", CLASSES)
def test_classes_are_those_of_the_stubs(name):
    made, wanted = getattr(_core, name), stub_class(name).functions
    there = public(vars(made)) | {special for special in SPECIAL if special in vars(made) and special in wanted}
    assert set(wanted) == there
    for member, parameters in wanted.items():
        found = getattr(made, member)
        assert isinstance(found, property) == (parameters == [None]), member
        if not isinstance(found, property):
            assert signatures_of(found) == parameters, member


# The types of others take most of the time, and none of them is in the stubs but those of NumPy.
WITHOUT_OTHERS = """[mypy]
[mypy-xarray.*]
follow_imports = skip
[mypy-numpy.*]
follow_imports = skip
follow_imports_for_stubs = True
"""


def test_stubtest_finds_nothing(tmp_path):
    """The stubs have all of the module, and the package is typed as its users have it."""
    pytest.importorskip("mypy", reason="Debian: mypy")
    (tmp_path / "mypy.ini").write_text(WITHOUT_OTHERS)
    package = str(pathlib.Path(esvr.__file__).parent.parent)
    ran = subprocess.run([sys.executable, "-m", "mypy.stubtest", "esvr", "--mypy-config-file", "mypy.ini"], cwd=tmp_path, text=True,
                         capture_output=True, env={**os.environ, "PYTHONPATH": package, "MYPYPATH": package})
    assert ran.returncode == 0, ran.stdout + ran.stderr


def test_everything_has_a_docstring():
    """pybind11 begins a docstring with the signature."""
    def text_of(thing):
        text = inspect.getdoc(thing) or ""
        return text if isinstance(thing, property) or inspect.isfunction(thing) or inspect.isclass(thing) \
            else re.sub(r"^.*\n?", "", text, count=1).strip()
    missing = [name for name in FUNCTIONS + CLASSES if not text_of(getattr(esvr, name))]
    for name in CLASSES:
        made = getattr(esvr, name)
        missing += [f"{name}.{member}" for member in public(vars(made)) if not text_of(getattr(made, member))]
    assert not missing
