# SPDX-License-Identifier: GPL-3.0-or-later
"""Work that takes long. It runs in a thread, so that Blender goes on and the user can cancel it.

This module does not use bpy, which only Blender's own thread may use.
"""
import os
import shutil
import subprocess
import tempfile
import threading

POLL_SECONDS = 0.05
END_SECONDS = 3.0  # that a program gets to end by itself after it was cancelled


class Cancelled(Exception):
    """The user has cancelled the job."""


class JobFailed(Exception):
    """The job has failed. The text is for the user."""


class Job:
    """Runs work(job), and keeps its result or its error.

    The work calls report() while it goes on. report() raises Cancelled after cancel() was called.
    """

    def __init__(self, work):
        self._work = work
        self._cancel = threading.Event()
        self._thread = None
        self.fraction = 0.0
        self.text = ""
        self.result = None
        self.error = None

    def start(self):
        self._thread = threading.Thread(target=self.run, daemon=True)
        self._thread.start()

    def run(self):
        try:
            self.result = self._work(self)
        except Exception as error:  # the thread that asks for the result raises it
            self.error = error

    def cancel(self):
        self._cancel.set()

    def wait(self):
        if self._thread:
            self._thread.join()

    @property
    def is_done(self):
        return self._thread is None or not self._thread.is_alive()

    def report(self, fraction, text):
        if self._cancel.is_set():
            raise Cancelled()
        self.fraction, self.text = fraction, text

    def run_program(self, words, folder, watch=lambda log: None, accepted=(0,)):
        """Runs a program in a folder until it ends, and returns what it has written.

        `watch` is called with that text again and again. An exit code that is not accepted raises JobFailed. The
        program is ended if the job is cancelled or `watch` raises.
        """
        with tempfile.TemporaryDirectory() as place:
            log = os.path.join(place, "log")  # a file rather than a pipe, which blocks a program when it is full
            with started(words, folder, log) as process:
                try:
                    while not ended(process):
                        self.report(self.fraction, self.text)
                        watch(text_of(log))
                except BaseException:
                    end(process)
                    raise
            text = text_of(log)
        if process.returncode not in accepted:
            raise JobFailed(failure_text(words[0], process.returncode, text))
        return text


def started(words, folder, log):
    try:
        with open(log, "wb") as output:
            return subprocess.Popen([str(word) for word in words], cwd=folder, stdin=subprocess.DEVNULL, stdout=output,
                                    stderr=subprocess.STDOUT, creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0))
    except OSError as error:
        raise JobFailed(f"{words[0]} cannot be started: {error.strerror}") from error


def ended(process):
    try:
        process.wait(POLL_SECONDS)
    except subprocess.TimeoutExpired:
        return False
    return True


def end(process):
    process.terminate()
    try:
        process.wait(END_SECONDS)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


def text_of(log):
    with open(log, encoding="utf-8", errors="replace") as file:
        return file.read()


def failure_text(program, code, text):
    lines = [line for line in text.splitlines() if line.strip() and not line.startswith("{")]  # without progress
    return "\n".join(lines) or f"{os.path.basename(str(program))} ended with the exit code {code}"


def find_program(name, path=""):
    """The path of a program: `path`, which the user has set, or the one that PATH has.

    Raises JobFailed if there is none.
    """
    found = shutil.which(path or name)
    if found:
        return os.path.abspath(found)
    if path:
        raise JobFailed(f"'{path}' is not a program. Set the path of {name} in the preferences of the add-on")
    raise JobFailed(f"The program {name} was not found. Install ESVR's programs, "
                    f"or set the path of {name} in the preferences of the add-on")
