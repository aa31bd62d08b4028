# SPDX-License-Identifier: GPL-3.0-or-later
"""Converts the .vdb files of a volume to an .esvr file by the program vdb2esvr.

This module does not use bpy.
"""
import json
import os
from dataclasses import dataclass
from typing import Optional, Tuple

from . import cache, jobs
from .source import numbered, places_for

PROGRAM = "vdb2esvr"
TARGET_MISSED = 4  # exit code; the file is written


@dataclass(frozen=True)
class Input:
    """A .vdb file, or the files of a sequence: those that `path` gives with the numbers in `frames`."""
    path: str
    frames: Optional[Tuple[int, int]] = None


@dataclass(frozen=True)
class Goal:
    """An option of vdb2esvr and its value: --psnr 45. Without an option, vdb2esvr has its own goal."""
    option: str = ""
    value: str = ""

    def words(self):
        return [word for word in (self.option, self.value) if word]


@dataclass(frozen=True)
class Export:
    program: str
    input: Input
    output: str
    goal: Goal
    topology: str = "auto"
    representation: str = "auto"


def export(job, wanted):
    """Writes wanted.output. Returns what the user should know; empty if everything was reached."""
    job.report(0.0, f"Converting {os.path.basename(wanted.input.path)}")
    folder, name = os.path.split(wanted.output)
    try:
        with cache.unfinished(folder) as work:
            told = job.run_program(words_of(wanted), work, lambda log: tell_progress(job, log), (0, TARGET_MISSED))
            os.replace(os.path.join(work, PLAIN_OUTPUT), os.path.join(folder, name))
    except OSError as error:
        raise jobs.JobFailed(str(error)) from error
    return warnings_in(told)


PLAIN_OUTPUT = "out.esvr"  # no pattern, whatever the user's name is


def words_of(wanted):
    words = [wanted.program, *input_words(wanted.input), PLAIN_OUTPUT, *wanted.goal.words(), "--progress", "json"]
    # Both options have no meaning for voxels that are stored bit for bit.
    if wanted.goal.option != "--lossless":
        words += ["--topology", wanted.topology, "--representation", wanted.representation]
    return words


def input_words(source):
    """The input and, of a sequence, its frames as vdb2esvr takes them."""
    if source.frames is None:
        if not os.path.isfile(source.path):
            raise jobs.JobFailed(f"{source.path}: there is no such file")
        return [source.path]
    folder, name = os.path.split(source.path)
    match = numbered(name)
    if not match:
        raise jobs.JobFailed(f"{source.path}: the name has no number of a frame")
    first, last = source.frames
    pattern = match["head"] + places_for(match["digits"]) + match["tail"]
    return [os.path.join(folder, pattern), "--frames", f"{first}-{last}", "--missing", "skip"]  # as Blender shows it


def tell_progress(job, log):
    """The last line of JSON of vdb2esvr tells how far the running fit or the sequence is."""
    lines = [line for line in log.splitlines() if line.startswith("{") and line.endswith("}")]
    if not lines:
        return
    told = json.loads(lines[-1])
    what = f"frame {told['frame']}" if "frame" in told else told["grid"]
    job.report(told["fraction"], f"Converting {what}")


def warnings_in(text):
    return "\n".join(line for line in text.splitlines() if line.startswith(f"{PROGRAM}: "))
