# SPDX-License-Identifier: GPL-3.0-or-later
"""Decodes .esvr files to .vdb files in the cache, by the Python module esvr or by the program esvr2vdb.

Both write the same voxels. This module does not use bpy.
"""
import importlib
import os
import re
from dataclasses import dataclass

from . import cache, jobs
from .source import Source, SourceError, within

PROGRAM = "esvr2vdb"
LISTED = re.compile(r", (\d+) frames in \d+ groups$")  # the first line of --list of a sequence


@dataclass(frozen=True)
class Request:
    """What is decoded. `decoder` is a ModuleDecoder or a ProgramDecoder."""
    source: Source
    settings: cache.Settings
    root: str  # the folder of the cache
    decoder: object


def decode(job, request):
    """Returns the entry of the cache, which is made if it is not there.

    Raises JobFailed with the text of the decoder, and leaves nothing unfinished behind.
    """
    source, settings = request.source, request.settings
    try:
        identity = cache.identity_of(source, settings)
        folder = cache.folder_of(request.root, source, identity)
        known = cache.entry_in(folder)
        if known:
            return known
        with cache.unfinished(request.root) as work:
            files = decode_into(work, job, request)
            if cache.identity_of(source, settings) != identity:
                raise jobs.JobFailed(f"{source.text} has changed while it was decoded")
            return cache.complete(work, folder, files, source)
    except (OSError, SourceError) as error:
        raise jobs.JobFailed(str(error)) from error


def decode_into(work, job, request):
    """Returns the names of the files by their frames."""
    source, settings, decoder = request.source, request.settings, request.decoder
    job.report(0.0, f"Decoding {source.stem}")
    if source.is_numbered:
        frames = list(source.files(settings.frames))
    else:
        frames = frames_in(source.text, job, request)
    if frames is None:
        name = cache.name_of(source.stem, None)
        decoder.decode_file(job, source.text, settings, os.path.join(work, name))
        return {None: name}
    if frames[0] < 0:
        raise jobs.JobFailed(f"{source.text}: Blender shows no frames with negative numbers")
    decoder.decode_frames(job, source, frames, settings, work)
    return {frame: cache.name_of(source.stem, frame) for frame in frames}


def frames_in(path, job, request):
    """The wanted frames of a sequence; None if the file holds no sequence."""
    frames = request.decoder.frames(job, path)
    if frames is None:
        return None
    wanted = [frame for frame in frames if within(frame, request.settings.frames)]
    if not wanted:
        raise jobs.JobFailed(f"{path} has the frames {frames[0]} to {frames[-1]}, and none of them is chosen")
    return wanted


def esvr_module():
    """The Python module esvr; None if this Python does not have it."""
    try:
        module = importlib.import_module("esvr")
    except ImportError:
        return None
    return module if hasattr(module, "Sequence") else None  # a version that cannot save all grids


class ModuleDecoder:
    """Decodes by the Python module. A frame that has begun is decoded to its end after the job was cancelled."""

    def __init__(self, module):
        self._module = module

    def frames(self, job, path):
        return self._call(self._module.frames, path) or None

    def decode_file(self, job, path, settings, output):
        self._call(lambda: self._save(self._module.read(path), settings, output))

    def decode_frames(self, job, source, frames, settings, work):
        read = self._reader(source)
        for i, frame in enumerate(frames):
            job.report(i / len(frames), f"Decoding frame {frame} of {source.stem}")
            output = os.path.join(work, cache.name_of(source.stem, frame))
            self._call(lambda: self._save(read(frame), settings, output))

    def _reader(self, source):
        """A function that reads a frame."""
        if source.is_numbered:
            paths = source.numbered_files()
            return lambda frame: self._module.read(paths[frame])
        return self._call(self._module.Sequence, source.text).read

    def _save(self, file, settings, output):
        box = settings.box and (settings.box[:3], settings.box[3:])
        file.save(output, box=box, layers=settings.layers, max_ellipsoids=settings.max_ellipsoids)

    def _call(self, function, *arguments):
        try:
            return function(*arguments)
        except (self._module.Error, OSError, MemoryError) as error:
            raise jobs.JobFailed(str(error)) from error


class ProgramDecoder:
    """Decodes by esvr2vdb."""

    def __init__(self, program):
        self._program = program

    def frames(self, job, path):
        text = job.run_program([self._program, "--list", path], os.path.dirname(path))
        lines = text.splitlines()
        if not lines or not LISTED.search(lines[0]):
            return None
        return [int(row.group(1)) for row in (re.match(r"\s*(-?\d+) ", line) for line in lines[1:]) if row]

    def decode_file(self, job, path, settings, output):
        # In its own folder, because the path of a folder may contain what means a number in a pattern.
        folder, name = os.path.split(output)
        job.run_program([self._program, path, name, *part_options(settings)], folder)

    def decode_frames(self, job, source, frames, settings, work):
        def watch(_):
            done = sum(name.endswith(".vdb") for name in os.listdir(work))
            job.report(done / len(frames), f"Decoded {done} of {len(frames)} frames of {source.stem}")

        words = [self._program, source.text, cache.pattern_of(source.stem), "--on-error", "stop",
                 "--frames", ",".join(str(frame) for frame in frames)]
        job.run_program(words + part_options(settings), work, watch)


def part_options(settings):
    words = []
    if settings.layers is not None:
        words += ["--lod", str(settings.layers)]
    if settings.max_ellipsoids is not None:
        words += ["--max-ellipsoids", str(settings.max_ellipsoids)]
    if settings.box is not None:
        words += ["--bbox", ",".join(str(side) for side in settings.box)]
    return words
