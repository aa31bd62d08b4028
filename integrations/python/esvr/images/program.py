"""What the program of this folder needs: options, help, messages, exit codes, and a child process that survives
the faults of C libraries.

A program is a table of options and a function that does the work. The messages and exit codes are those of the other
programs of ESVR: 0 done, 1 failure, 2 usage, 3 bad input, 5 out of memory.
"""
import argparse
import contextlib
import fcntl
import logging
import os
import re
import resource
import signal
import sys
import textwrap
import traceback
import warnings
from dataclasses import dataclass

import esvr

from .image import unit_named

WIDTH = 100  # columns of --help
PATIENCE_S = 1  # after an interruption; then a library that does not return is ended
CRASHES = {signal.SIGSEGV, signal.SIGABRT, signal.SIGBUS, signal.SIGFPE, signal.SIGILL}


@dataclass
class Option:
    """An option of a program. Without a name for its value it is a switch; kind converts its text, or has the texts that it
    may be."""
    name: str
    value: str
    text: str
    kind: object = str
    short: str = ""
    default: object = None

    def title(self):
        names = f"-{self.short}, --{self.name}" if self.short else f"--{self.name}"
        return f"{names} {self.value}" if self.value else names


COMMON = [Option("threads", "N", "number of threads", int),
          Option("quiet", "", "print errors only", short="q"),
          Option("verbose", "", "print more messages", short="v"),
          Option("help", "", "print this text", short="h"),
          Option("version", "", "print the versions of all parts")]


@dataclass
class Program:
    name: str
    purpose: str
    usage: str
    options: list
    notes: str
    examples: str

    # -- help ------------------------------------------------------------------------------------------------------
    def help(self):
        wide = max(len(option.title()) for option in self.options) + 4
        rows = [textwrap.fill(option.text, WIDTH, initial_indent=f"  {option.title():{wide - 2}}", subsequent_indent=" " * wide)
                for option in self.options]
        short = ", ".join(f"-{o.short}" if o.short else f"--{o.name}" for o in COMMON)
        notes = "\n".join(textwrap.fill(line, WIDTH) for line in self.notes.splitlines())
        return "\n".join([textwrap.fill(self.purpose, WIDTH), "", "Usage:", self.usage, "", "Options:",
                          *rows, f"  common to all programs: {short} "
                          "(--quiet, --verbose, --help)", "", "Notes:", notes, "", "Examples:", self.examples]) + "\n"

    def man_page(self):
        def escaped(text):
            text = text.replace("\\", "\\e").replace("-", "\\-")
            return re.sub(r"^([.'])", r"\\&\1", text, flags=re.MULTILINE)

        def options(title, these):
            lines = [f".SH {title}"]
            for option in these:
                names = (f"\\fB\\-{option.short}\\fR, " if option.short else "") + f"\\fB{escaped('--' + option.name)}\\fR"
                value = f" \\fI{escaped(option.value)}\\fR" if option.value else ""
                lines += [".TP", names + value, escaped(option.text)]
            return lines

        def exact(title, text):
            return [f".SH {title}", ".nf", escaped(text), ".fi"]

        sentence = self.purpose.split(". ")[0].rstrip(".")
        notes = "\n.PP\n".join(escaped(line) for line in self.notes.splitlines() if line)
        return "\n".join([f'.TH {self.name.upper()} 1 "" "esvr {esvr.__version__}" ESVR', ".SH NAME",
                          f"{self.name} \\- {escaped(sentence)}", *exact("SYNOPSIS", self.usage), ".SH DESCRIPTION",
                          escaped(self.purpose), *options("OPTIONS", self.options), *options("COMMON OPTIONS", COMMON),
                          ".SH NOTES", notes, *exact("EXAMPLES", self.examples)]) + "\n"

    def topic(self, name):
        if name == "options":
            return "".join(f"--{option.name}\n" for option in self.options + COMMON)
        return self.man_page() if name == "man" else self.help()

    # -- arguments -------------------------------------------------------------------------------------------------
    def parse(self, words):
        """The options by their names, with underscores for hyphens; None if a text was asked for and printed."""
        parser = Parser(prog=self.name, add_help=False, usage=argparse.SUPPRESS)
        parser.add_argument("files", nargs="*")
        for option in self.options + COMMON:
            names = [f"--{option.name}"] + ([f"-{option.short}"] if option.short else [])
            if not option.value:
                parser.add_argument(*names, action="store_true")
            elif isinstance(option.kind, tuple):
                parser.add_argument(*names, choices=option.kind, default=option.default)
            else:
                parser.add_argument(*names, type=option.kind, default=option.default)
        arguments = parser.parse_intermixed_args(words)
        if arguments.help:
            sys.stdout.write(self.topic(arguments.files[0] if arguments.files else ""))
            return None
        if arguments.version:
            sys.stdout.write(f"{self.name} {esvr.__version__}\n{readers_text()}")
            return None
        if arguments.threads is not None and arguments.threads < 1:
            raise esvr.UsageError("--threads must be 1 or more")
        return arguments


class Parser(argparse.ArgumentParser):
    def __init__(self, **options):
        super().__init__(**options)
        self._negative_number_matcher = re.compile(r"-(\d|\.\d)")  # also -1e3 is a number and no option

    def error(self, message):
        raise esvr.UsageError(message)


def number(text):
    value = float(text)
    if value != value or abs(value) > 3.4028234663852886e38:
        raise argparse.ArgumentTypeError(f"'{text}' is not a number that a float holds")
    return value


number.__name__ = "number"  # argparse names the type in its message


def byte_size(text):
    match = re.fullmatch(r"(\d+(?:\.\d+)?)\s*([KMGT]?)(i?B?)", text.strip(), re.IGNORECASE)
    if not match or float(match[1]) == 0:
        raise argparse.ArgumentTypeError(f"'{text}' is not a size like 500MB or 4G")
    base = 1024 if match[3].lower().startswith("i") else 1000
    return int(float(match[1]) * base ** " KMGT".index(match[2].upper() or " "))


byte_size.__name__ = "size"


def length_unit(text):
    unit = unit_named(text)
    if unit is None:
        raise argparse.ArgumentTypeError(f"'{text}' is no unit of length; mm, um, nm, angstrom, m, ... are")
    return unit


def readers_text():
    """The versions of the libraries that read and write, for --version; those that are missing are left out."""
    import importlib.metadata
    lines = []
    for name in ("numpy", "tifffile", "nibabel", "mrcfile", "pydicom", "h5py", "netCDF4", "zarr", "GDAL"):
        try:
            lines.append(f"{name} {importlib.metadata.version(name)}")
        except importlib.metadata.PackageNotFoundError:
            continue
    return f"OpenVDB through esvr {esvr.__version__}\n" + ", ".join(lines) + "\n"


# -- messages ------------------------------------------------------------------------------------------------------
class Log:
    """Messages on stderr, and a progress bar if that is a terminal."""

    def __init__(self, program, arguments):
        self.program, self.quiet, self.verbose = program, arguments.quiet, arguments.verbose
        self.bar = sys.stderr.isatty() and not self.quiet

    def info(self, text):
        if not self.quiet:
            self._print(text)

    def detail(self, text):
        if self.verbose and not self.quiet:
            self._print(text)

    def warning(self, text):
        self.info(f"{self.program}: warning: {text}")

    def progress(self, name, share):
        if self.bar:
            full = int(30 * share)
            sys.stderr.write(f"\r{name} [{'=' * full}{' ' * (30 - full)}] {share:4.0%}" + ("\r\x1b[K" if share >= 1 else ""))
            sys.stderr.flush()

    def _print(self, text):
        sys.stderr.write(printable(text) + "\n")


def printable(text):
    """A text on one line, in which names of files cannot move the cursor."""
    return "".join(c if c.isprintable() else "?" if c != "\n" else " " for c in str(text))


# -- running -------------------------------------------------------------------------------------------------------
def exit_code(error):
    if isinstance(error, esvr.UsageError):
        return 2
    if isinstance(error, esvr.BadInput):
        return 3
    if isinstance(error, (esvr.DeviceError, MemoryError)):
        return 5
    return 130 if isinstance(error, KeyboardInterrupt) else 1


def complain(program, error, verbose):
    text = "out of memory" if type(error) is MemoryError else \
        "interrupted" if isinstance(error, KeyboardInterrupt) else str(error) or type(error).__name__
    sys.stderr.write(f"{program}: {printable(text)}\n")
    if isinstance(error, esvr.MemoryExceeded):
        sys.stderr.write("The option --max-memory allows more.\n")
    elif isinstance(error, esvr.UsageError):
        sys.stderr.write(f"Try '{program} --help' for more information.\n")
    if verbose:
        traceback.print_exception(error)


def run_here(program, work, verbose):
    """Runs work(). Returns the exit code."""
    try:
        work()
        return 0
    except (Exception, KeyboardInterrupt) as error:
        complain(program, error, verbose)
        return exit_code(error)


def run_in_child(program, inputs, outputs, work, verbose):
    """Runs work() in a child process and returns its exit code.

    A library that ends the process on a damaged file ends the child only. What it left of its outputs is then removed, and
    the message names the input.
    """
    sys.stdout.flush()
    sys.stderr.flush()
    child = os.fork()
    if child == 0:
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))  # a crash is reported, and leaves no file
        signal.signal(signal.SIGINT, interrupt_once)
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
            os.kill(child, signal.SIGINT if number == signal.SIGINT else signal.SIGKILL)
        signal.alarm(PATIENCE_S)

    before = {number: signal.signal(number, stop) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGALRM)}
    _, status = os.waitpid(child, 0)
    signal.alarm(0)
    for number, handler in before.items():
        signal.signal(number, handler)
    code = os.waitstatus_to_exitcode(status)
    if code >= 0 and not stopped:
        return code
    for output in outputs:
        remove_parts(output, child)
    if stopped:
        if code != 130:  # the child has not said so
            sys.stderr.write(f"{program}: interrupted\n")
        return 128 + stopped[0]
    names = ", ".join(map(str, inputs[:3]))
    if -code in CRASHES:
        sys.stderr.write(f"{program}: {printable(names)}: the library that reads it crashed "
                         f"({signal.Signals(-code).name}); the file is damaged, or holds what the library cannot read\n")
        return 3
    if -code == signal.SIGKILL:
        sys.stderr.write(f"{program}: {printable(names)}: the system ended the program, probably for want of memory\n")
        return 5
    return 1


def interrupt_once(number, frame):
    """The terminal and the parent process both may interrupt."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    raise KeyboardInterrupt


def part_of(path, pid=None):
    """The name under which an output is written until it is complete."""
    folder, name = os.path.split(os.fspath(path))
    return os.path.join(folder, f".{name}.{os.getpid() if pid is None else pid}.part")


def remove_parts(output, pid):
    """Removes what a process that was ended left of an output: its own part, and a temporary file of the library, which
    no process holds locked any more."""
    folder = os.path.dirname(os.fspath(output)) or "."
    for entry in os.listdir(folder):
        path = os.path.join(folder, entry)
        if entry.startswith(".esvr-") and entry.endswith(".tmp"):
            with open(path, "rb") as file:
                try:
                    fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                except OSError:
                    continue
                os.unlink(path)
        elif entry == os.path.basename(part_of(output, pid)):
            os.unlink(path)


def main(program, work):
    """Parses the command line and calls work(arguments), which returns the exit code."""
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)  # a limit on file sizes then gives an error, not a signal
    verbose = False
    try:
        arguments = program.parse(sys.argv[1:])
        if arguments is None:
            sys.stdout.flush()
            return 0
        verbose = arguments.verbose
        if arguments.threads:
            os.environ["OMP_NUM_THREADS"] = str(arguments.threads)
            os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:arguments.threads])
        return work(arguments)
    except BrokenPipeError:
        return 1
    except (Exception, KeyboardInterrupt) as error:
        complain(program.name, error, verbose)
        return exit_code(error)


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
    if not str(path).endswith(tuple(extensions)):
        raise esvr.UsageError(f"cannot write {path}: its name must end in {' or '.join(extensions)}")
    if os.path.isdir(path):
        raise esvr.Error(f"cannot write {path}: it is a folder")
    if any(os.path.exists(path) and os.path.exists(name) and os.path.samefile(path, name) for name in inputs):
        raise esvr.UsageError(f"cannot write {path}: it is the input")
    if os.path.exists(path) and not overwrite:
        raise esvr.Error(f"cannot write {path}: it exists already (--force replaces it)")
    folder = os.path.dirname(os.fspath(path)) or "."
    if not os.path.isdir(folder):
        raise esvr.Error(f"cannot write {path}: there is no folder {folder}")
    if not os.access(folder, os.W_OK):
        raise esvr.Error(f"cannot write {path}: the folder {folder} is not writable")
