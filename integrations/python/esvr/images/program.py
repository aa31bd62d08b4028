"""What the programs of this folder need: options, help, messages, exit codes, and a child process that survives the faults of C
libraries.

The messages and exit codes are those of the other programs of ESVR: 0 done, 1 failure, 2 usage, 3 bad input, 5 out of memory.
"""
import argparse
import contextlib
import fcntl
import importlib.metadata
import logging
import os
import re
import resource
import signal
import sys
import textwrap
import traceback
import warnings

import esvr
from esvr._core import _did_you_mean

from .image import unit_named

WIDTH = 100  # columns of --help
CRASHES = {signal.SIGSEGV, signal.SIGABRT, signal.SIGBUS, signal.SIGFPE, signal.SIGILL}


# -- the command line ----------------------------------------------------------------------------------------------
def option(name, value, text, kind=str, short="", default=None):
    """The names of an option and what add_argument() needs. Without a name for its value it is a switch; kind converts its text, or
    has the texts that it may be."""
    what = {"action": "store_true"} if not value else {"metavar": value, "default": default, **(
        {"choices": kind} if isinstance(kind, tuple) else {"type": kind})}
    return [f"-{short}"] * bool(short) + [f"--{name}"], {"help": text, **what}


class Parser(argparse.ArgumentParser):
    """The options of a program and its texts of --help."""

    def __init__(self, name, purpose, usage, options, notes, examples):
        super().__init__(
            name, argparse.SUPPRESS, f"{textwrap.fill(purpose, WIDTH)}\n\nUsage:\n{usage}",
            "common to all programs: --threads N, -q, -v, -h, --version (--quiet, --verbose, --help)\n\nNotes:\n"
            f"{textwrap.fill(notes, WIDTH)}\n\nExamples:\n{examples}", add_help=False,
            formatter_class=lambda prog: argparse.RawDescriptionHelpFormatter(prog, max_help_position=26, width=WIDTH))
        self._negative_number_matcher = re.compile(r"-(\d|\.\d)")  # also -1e3 is a number and no option
        self.add_argument("files", nargs="*", help=argparse.SUPPRESS)
        group = self.add_argument_group("Options")
        self.options = [group.add_argument(*names, **words) for names, words in options]
        self.options.append(self.add_argument("--threads", type=count(1), help=argparse.SUPPRESS))
        self.options += [self.add_argument(*names.split(), action="store_true", help=argparse.SUPPRESS)
                         for names in ("-q --quiet", "-v --verbose", "-h --help", "--version")]

    def error(self, message):
        unknown = re.match(r"unrecognized arguments: (?:.* )??(--[^ =]+)", message)
        refused = re.search(r"invalid choice: '(.*)' \(choose from (.*)\)$", message)
        if unknown:
            message += _did_you_mean(unknown[1], [action.option_strings[-1] for action in self.options])
        elif refused:
            message += _did_you_mean(refused[1], re.findall(r"'([^']*)'", refused[2]))
        raise esvr.UsageError(message)

    def parse(self, words):
        """The options by their names, with underscores for hyphens; None if a text was asked for and printed."""
        arguments = self.parse_intermixed_args(words)
        if arguments.help:
            sys.stdout.write(self.topic("".join(arguments.files[:1])))
        elif arguments.version:
            sys.stdout.write(f"{self.prog} {esvr.__version__}\n{readers_text()}\n")
        return None if arguments.help or arguments.version else arguments

    def topic(self, name):
        if name == "options":  # for the completion of shells
            return "".join(f"{option.option_strings[-1]}\n" for option in self.options)
        text = self.format_help().lstrip()
        if name != "man":
            return text
        text = re.sub(r"^([.'])", r"\\&\1", text.replace("\\", "\\e").replace("-", "\\-"), flags=re.MULTILINE)
        text = re.sub(r"^(\w+):$", lambda title: f".fi\n.SH {title[1].upper()}\n.nf", text, flags=re.MULTILINE)
        purpose = " ".join(self.description.partition("\n\n")[0].split()).partition(". ")[0].rstrip(".")
        return (f'.TH {self.prog.upper()} 1 "" "esvr {esvr.__version__}" ESVR\n.SH NAME\n{self.prog} \\- {purpose}\n'
                f".SH DESCRIPTION\n.nf\n{text}.fi\n")


def number(text):
    value = float(text)
    if value != value or abs(value) > 3.4028234663852886e38:
        raise argparse.ArgumentTypeError(f"'{text}' is not a number that a float holds")
    return value


def count(least=0):
    def whole_number(text):
        if int(text) < least:
            raise argparse.ArgumentTypeError(f"'{text}' is below {least}")
        return int(text)
    return whole_number


def byte_size(text):
    match = re.fullmatch(r"(\d+(?:\.\d+)?)\s*([KMGT]?)(i?B?)", text.strip(), re.IGNORECASE)
    if not match or float(match[1]) == 0:
        raise argparse.ArgumentTypeError(f"'{text}' is not a size like 500MB or 4G")
    base = 1024 if match[3].lower().startswith("i") else 1000
    return int(float(match[1]) * base ** " KMGT".index(match[2].upper() or " "))


def length_unit(text):
    unit = unit_named(text)
    if unit is None:
        raise argparse.ArgumentTypeError(f"'{text}' is no unit of length; mm, um, nm, angstrom, m, ... are")
    return unit


def readers_text():
    """The versions of the libraries that read and write; those that are missing are left out."""
    found = []
    for name in ("numpy", "tifffile", "nibabel", "mrcfile", "pydicom", "h5py", "netCDF4", "zarr", "GDAL"):
        with contextlib.suppress(importlib.metadata.PackageNotFoundError):
            found.append(f"{name} {importlib.metadata.version(name)}")
    return f"OpenVDB through esvr {esvr.__version__}\n" + ", ".join(found)


# -- messages ------------------------------------------------------------------------------------------------------
class Log:
    """Messages on stderr, and a progress bar if that is a terminal."""

    def __init__(self, program, arguments):
        self.program, self.quiet, self.verbose = program, arguments.quiet, arguments.verbose
        self.bar = sys.stderr.isatty() and not self.quiet

    def info(self, text):
        if not self.quiet:
            sys.stderr.write(printable(text) + "\n")

    def detail(self, text):
        if self.verbose:
            self.info(text)

    def warning(self, text):
        self.info(f"{self.program}: warning: {text}")

    def progress(self, name, share):
        if self.bar:
            full = int(30 * share)
            sys.stderr.write(f"\r{name} [{'=' * full}{' ' * (30 - full)}] {share:4.0%}" + ("\r\x1b[K" if share >= 1 else ""))
            sys.stderr.flush()


def printable(text):
    """A text on one line, in which names of files cannot move the cursor."""
    return "".join(c if c.isprintable() else "?" if c != "\n" else " " for c in str(text))


# -- running -------------------------------------------------------------------------------------------------------
def run_here(program, work, verbose):
    """Runs work(), which may return an exit code. Returns the exit code."""
    try:
        return work() or 0
    except BrokenPipeError:
        return 1
    except Exception as error:
        text = "out of memory" if type(error) is MemoryError else str(error) or type(error).__name__
        sys.stderr.write(f"{program}: {printable(text)}\n")
        if isinstance(error, esvr.MemoryExceeded):
            sys.stderr.write("The option --max-memory allows more.\n")
        elif isinstance(error, esvr.UsageError):
            sys.stderr.write(f"Try '{program} --help' for more information.\n")
        if verbose:
            traceback.print_exception(error)
        codes = {esvr.UsageError: 2, esvr.BadInput: 3, esvr.DeviceError: 5, MemoryError: 5}
        return next((code for kind, code in codes.items() if isinstance(error, kind)), 1)


def run_in_child(program, inputs, outputs, work, verbose):
    """Runs work() in a child process and returns its exit code.

    A library that ends the process on a damaged file, or does not return, ends the child only. What it left of its outputs is
    then removed, and the message names the input.
    """
    sys.stdout.flush()
    sys.stderr.flush()
    child = os.fork()
    if child == 0:
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))  # a crash is reported, and leaves no file
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent ends this process
        logging.disable(logging.CRITICAL)  # readers say in words of their own what the program says
        warnings.simplefilter("ignore")
        code = run_here(program, work, verbose)
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)
    stopped = []

    def stop(number, frame):
        stopped.append(number)
        with contextlib.suppress(ProcessLookupError):
            os.kill(child, signal.SIGKILL)
    before = {number: signal.signal(number, stop) for number in (signal.SIGINT, signal.SIGTERM)}
    _, status = os.waitpid(child, 0)
    for number, handler in before.items():
        signal.signal(number, handler)
    code = os.waitstatus_to_exitcode(status)
    if code >= 0:
        return code
    for output in outputs:
        remove_parts(output, child)
    names, ended = printable(", ".join(map(str, inputs[:3]))), signal.Signals(-code).name
    if stopped:
        said, code = "interrupted", 128 + stopped[0]
    elif -code in CRASHES:
        said, code = f"{names}: the library that reads it crashed ({ended}); the file is damaged, or holds what it cannot read", 3
    else:
        said, code = f"{names}: the system ended the program ({ended}), probably for want of memory", 5
    sys.stderr.write(f"{program}: {said}\n")
    return code


def part_of(path, pid=None):
    """The name under which an output is written until it is complete."""
    folder, name = os.path.split(os.fspath(path))
    return os.path.join(folder, f".{name}.{os.getpid() if pid is None else pid}.part")


def remove_parts(output, pid):
    """Removes what a process that was ended left of an output: its own part, and a temporary file of the library, which
    no process holds locked any more."""
    folder = os.path.dirname(os.fspath(output)) or "."
    with contextlib.suppress(FileNotFoundError):
        os.unlink(part_of(output, pid))
    for path in (os.path.join(folder, name) for name in os.listdir(folder) if name.startswith(".esvr-") and name.endswith(".tmp")):
        with open(path, "rb") as file, contextlib.suppress(BlockingIOError):
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            os.unlink(path)


def main(parser, work):
    """Parses the command line and calls work(arguments). Returns the exit code."""
    def run():
        arguments = parser.parse(sys.argv[1:])
        if arguments is None:
            return sys.stdout.flush()
        if arguments.threads:
            os.environ["OMP_NUM_THREADS"] = str(arguments.threads)
            os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:arguments.threads])
        return work(arguments)
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)  # a limit on file sizes then gives an error, not a signal
    return run_here(parser.prog, run, {"-v", "--verbose"} & set(sys.argv))


# -- files ---------------------------------------------------------------------------------------------------------
def number_mark(name):
    """The place of a number in a name (####, @@@@, %04d or $F4) as a match, and its digits; None and 0 if there is none."""
    match = re.search(r"#+|@+|%0?\d*d|\$F\d*", name)
    if not match:
        return None, 0
    mark = match[0]
    return match, 4 if mark == "#" else len(mark) if mark[0] in "#@" else int(re.sub(r"\D", "", mark) or 1)


def frame_path(path, number):
    """The file of a number, if the name has a place for it."""
    folder, name = os.path.split(os.fspath(path))
    mark, digits = number_mark(name)
    return os.path.join(folder, f"{name[:mark.start()]}{number:0{digits}d}{name[mark.end():]}") if mark else path


def check_output(path, extensions, overwrite, inputs=()):
    """Refuses an output before the work begins."""
    folder = os.path.dirname(os.fspath(path)) or "."
    if not str(path).endswith(tuple(extensions)):
        raise esvr.UsageError(f"cannot write {path}: its name must end in {' or '.join(extensions)}")
    if any(os.path.exists(path) and os.path.exists(name) and os.path.samefile(path, name) for name in inputs):
        raise esvr.UsageError(f"cannot write {path}: it is the input")
    for is_wrong, why in ((os.path.isdir(path), "it is a folder"),
                          (os.path.exists(path) and not overwrite, "it exists already (--force replaces it)"),
                          (not os.path.isdir(folder), f"there is no folder {folder}"),
                          (not os.access(folder, os.W_OK), f"the folder {folder} is not writable")):
        if is_wrong:
            raise esvr.Error(f"cannot write {path}: {why}")
