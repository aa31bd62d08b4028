# SPDX-License-Identifier: GPL-3.0-or-later
"""Volumes of Blender that show decoded files of the cache."""
import os

import bpy

from . import cache, preferences
from .decode import Request
from .properties import settings_of
from .source import Source, SourceError


def is_ours(volume):
    """True for a volume that was imported and can be changed."""
    return bool(volume.esvr.source) and volume.library is None


def source_of(volume):
    return Source(preferences.absolute(volume.esvr.source))


def request_of(volume):
    return Request(source_of(volume), settings_of(volume.esvr), preferences.cache_root(), preferences.decoder())


def shown_folder(volume):
    return os.path.dirname(preferences.absolute(volume.filepath))


def is_current(volume):
    """True if a volume shows what its source and its settings give now.

    Raises SourceError or OSError if the source cannot be found.
    """
    source, settings, folder = source_of(volume), settings_of(volume.esvr), shown_folder(volume)
    wanted = cache.folder_of(os.path.dirname(folder), source, cache.identity_of(source, settings))
    return folder == wanted and cache.entry_in(folder) is not None


def state_of(volume):
    """A line for the user."""
    try:
        return "The volume is up to date" if is_current(volume) else "The source or the settings have changed"
    except (SourceError, OSError) as error:
        return str(error)


def relative_if_wanted(path):
    """The path as Blender would store it."""
    if not bpy.data.filepath or not bpy.context.preferences.filepaths.use_relative_paths:
        return path
    try:
        return bpy.path.relpath(path)
    except ValueError:  # on another drive of Windows
        return path


def show(volume, entry):
    """Lets a volume show an entry of the cache."""
    frames = entry.frames
    if frames and not volume.is_sequence:
        volume.frame_start = 1
    volume.filepath = relative_if_wanted(entry.first)
    volume.is_sequence = bool(frames)
    if frames:  # the frame frame_start of the scene shows the first file
        volume.frame_duration = frames[-1] - frames[0] + 1
        volume.frame_offset = frames[0] - 1
