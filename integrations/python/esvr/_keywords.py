"""A call with an argument that does not exist says which one may be meant. pybind11 would give the whole signature and no word of
what is wrong with it, and Python the name of a function that nobody called."""
import functools
import re
import types

from . import _core


def arguments_of(function):
    """The names of the arguments of a function, of which one of pybind11 has the signature in its docstring only."""
    if isinstance(function, types.FunctionType):
        code = function.__code__
        return [word for word in code.co_varnames[:code.co_argcount + code.co_kwonlyargcount] if word != "self"]
    name = re.escape(function.__name__)
    lines = re.findall(rf"^(?:\d+\. )?{name}\((.*)\) -> ", function.__doc__, re.MULTILINE)
    return [word for line in lines for word in re.findall(r"(?:^|, )(\w+): ", line) if word != "self"]


def explained(function, called):
    """The function, which names a wrong argument by the name under which it is called."""
    @functools.wraps(function)
    def call(*values, **named):
        try:
            return function(*values, **named)
        except TypeError:
            known = arguments_of(function)
            wrong = next((name for name in named if name not in known), None)
            if wrong is None:
                raise
            near = _core._did_you_mean(wrong, known) or f"; it has: {', '.join(known)}"
        raise TypeError(f"{called}() has no argument {wrong}{near}")
    return call


def is_function(member):
    """True for functions of Python and of pybind11, but not for the constructor of a class that has none, and properties."""
    kinds = (types.FunctionType, types.BuiltinFunctionType, staticmethod)
    return isinstance(member, kinds) or type(member).__name__ == "instancemethod"


def explain(namespace, prefix):
    """Replaces the public functions of the module or of a class, and its constructor."""
    for name, member in list(vars(namespace).items()):
        if not is_function(member) or (name.startswith("_") and name != "__init__"):
            continue
        function = explained(getattr(namespace, name), prefix.rstrip(".") if name == "__init__" else prefix + name)
        is_static = isinstance(namespace, type) and isinstance(member, (staticmethod, types.BuiltinFunctionType))
        setattr(namespace, name, staticmethod(function) if is_static else function)


def explain_all():
    """Does so for the functions of the module, and for those of its classes."""
    explain(_core, "esvr.")
    for name, member in list(vars(_core).items()):
        if isinstance(member, type) and not issubclass(member, BaseException):
            explain(member, f"{name}.")
