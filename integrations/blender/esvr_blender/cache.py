# SPDX-License-Identifier: GPL-3.0-or-later
"""The folders that keep decoded .vdb files.

The folder of a source has a name that follows from the source, the state of its files on the disk and the settings of
the decoder. After a change it has another name, so that files of another state are never taken. A folder appears
under its name when all of its files are complete.

This module does not use bpy.
"""
import hashlib
import json
import os
import re
import shutil
import sys
import uuid
from contextlib import contextmanager
from dataclasses import astuple, dataclass
from typing import Optional, Tuple

FORMAT = 1  # changes if the content of folders changes
RECORD = "esvr_cache.json"  # a file in every folder, with the names of the others
UNFINISHED = ".esvr-unfinished-"
DIGITS = 4  # of the number of a frame
LONGEST_STEM = 60  # characters; file systems allow 255 bytes


@dataclass(frozen=True)
class Settings:
    """How a source is decoded; None stands for all."""
    layers: Optional[int] = None
    max_ellipsoids: Optional[int] = None
    box: Optional[Tuple[int, ...]] = None     # x0, y0, z0, x1, y1, z1
    frames: Optional[Tuple[int, int]] = None  # the first and the last one


@dataclass(frozen=True)
class Entry:
    """A complete folder. `files` are names by their frames; the frame of a single file is None."""
    folder: str
    files: dict

    @property
    def frames(self):
        return sorted(frame for frame in self.files if frame is not None)

    @property
    def first(self):
        """The path that Blender shows; of a sequence, that of the first frame."""
        return os.path.join(self.folder, self.files[self.frames[0] if self.frames else None])


def user_folder():
    """The folder of this user for files that can be made again."""
    home = os.path.expanduser("~")
    if sys.platform == "win32":
        base = os.environ.get("LOCALAPPDATA") or os.path.join(home, "AppData", "Local")
    elif sys.platform == "darwin":
        base = os.path.join(home, "Library", "Caches")
    else:
        base = os.environ.get("XDG_CACHE_HOME") or os.path.join(home, ".cache")
    return os.path.join(base, "esvr_blender")


def identity_of(source, settings):
    """A text that differs for another source, for other bytes of its files, and for other settings."""
    state = [(frame, path, status.st_size, status.st_mtime_ns)
             for frame, path in source.files(settings.frames).items() for status in [os.stat(path)]]
    text = json.dumps([FORMAT, source.text, state, astuple(settings)])
    return hashlib.sha256(text.encode("utf-8", errors="surrogateescape")).hexdigest()[:16]


def plain(stem):
    """A name that is neither a pattern of the programs nor an option."""
    return re.sub(r"[^\w.-]", "_", stem).strip(".-_")[:LONGEST_STEM] or "volume"


def name_of(stem, frame):
    number = "" if frame is None else f"_{frame:0{DIGITS}d}"
    return f"{plain(stem)}{number}.vdb"


def pattern_of(stem):
    """The names of all frames, as the programs write it."""
    return f"{plain(stem)}_{'#' * DIGITS}.vdb"


def folder_of(root, source, identity):
    return os.path.join(root, f"{plain(source.stem)}-{identity}")


def entry_in(folder):
    """The entry of a folder; None if it is not complete."""
    try:
        with open(os.path.join(folder, RECORD), encoding="utf-8") as file:
            files = {None if frame == "" else int(frame): str(name) for frame, name in json.load(file)["files"]}
    except (OSError, ValueError, KeyError, TypeError):  # missing or damaged
        return None
    complete = files and all(os.path.isfile(os.path.join(folder, name)) for name in files.values())
    return Entry(folder, files) if complete else None


@contextmanager
def unfinished(root):
    """A new folder, which does not remain. What is complete is moved out of it."""
    os.makedirs(root, exist_ok=True)
    folder = os.path.join(root, UNFINISHED + uuid.uuid4().hex)
    os.mkdir(folder)
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def complete(work, folder, files, source):
    """Gives the folder `work`, with these files in it, its name."""
    with open(os.path.join(work, RECORD), "w", encoding="utf-8") as record:
        json.dump({"source": source.text,
                   "files": [["" if frame is None else frame, name] for frame, name in files.items()]}, record)
    if entry_in(folder) is None:  # otherwise another Blender was faster
        shutil.rmtree(folder, ignore_errors=True)
        os.rename(work, folder)
    return Entry(folder, files)


def remove_others(root, used):
    """Removes all folders of the cache but those that are used. Returns their number."""
    keep = {os.path.realpath(folder) for folder in used}
    removed = 0
    for name in os.listdir(root) if os.path.isdir(root) else []:
        folder = os.path.join(root, name)
        ours = os.path.isfile(os.path.join(folder, RECORD))
        if ours and os.path.realpath(folder) not in keep:
            shutil.rmtree(folder, ignore_errors=True)
            removed += 1
    return removed
