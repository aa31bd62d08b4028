# SPDX-License-Identifier: GPL-3.0-or-later
"""Volumes of Blender that show decoded files of the cache: what they remember of their .esvr file, and their panel ESVR.

They are decoded again after their settings were changed, and if they are not up to date when a file is opened.
"""
import os
import time

import bpy
from bpy.app.handlers import persistent
from bpy.props import BoolProperty, IntProperty, IntVectorProperty, PointerProperty, StringProperty

from . import cache, preferences
from .cache import Settings
from .decode import Request
from .modal import running
from .source import Source, SourceError

LARGEST = 2**31 - 1
DELAY_SECONDS = 0.5  # while which a user may go on changing settings

waiting = set()  # names of volumes


def schedule(name):
    """Lets a volume be decoded soon. In the background, scripts call esvr.reload themselves."""
    if bpy.app.background:
        return
    waiting.add(name)
    if bpy.app.timers.is_registered(reload_waiting):
        bpy.app.timers.unregister(reload_waiting)
    bpy.app.timers.register(reload_waiting, first_interval=DELAY_SECONDS)


def reload_waiting():
    """The function of the timer: what it returns is the time until it is called again."""
    if running:
        return DELAY_SECONDS
    names = [name for name in waiting if name in bpy.data.volumes]
    waiting.clear()
    windows = bpy.context.window_manager.windows
    if names and windows:
        with bpy.context.temp_override(window=windows[0]):
            reload(names, "INVOKE_DEFAULT")
    return None


def reload(names, context="EXEC_DEFAULT"):
    """Errors do not stop Blender: volumes whose source is missing go on showing what was decoded."""
    try:
        bpy.ops.esvr.reload(context, names="\n".join(names))
    except RuntimeError as error:
        print(error)
        if not bpy.app.background:
            show_error(str(error))


def show_error(text):
    """Shows a text at the mouse, because nobody has called the operator and would see its report."""
    def draw(menu, _):
        for line in text.splitlines():
            menu.layout.label(text=line)

    bpy.context.window_manager.popup_menu(draw, title="ESVR", icon="ERROR")


@persistent
def reload_after_load(*_):
    names = [volume.name for volume in bpy.data.volumes if volume.esvr.source]
    if bpy.app.background and names:
        reload(names)
    for name in names:
        schedule(name)


def changed(self, context):
    schedule(self.id_data.name)


class ESVRVolumeProperties(bpy.types.PropertyGroup):
    source: StringProperty(
        name="Source", subtype="FILE_PATH", update=changed,
        description="The .esvr file; a pattern such as smoke.####.esvr stands for the numbered files of a sequence")
    layers: IntProperty(
        name="Level of Detail", min=0, update=changed,
        description="Decode only this many importance layers of each grid, from the first; 0 decodes all")
    max_ellipsoids: IntProperty(
        name="Max Ellipsoids", min=0, update=changed,
        description="Decode only this many ellipsoids of each grid, those of the largest weight; 0 decodes all")
    use_box: BoolProperty(name="Only a Box", update=changed, description="Decode only the voxels of a box")
    box_min: IntVectorProperty(name="From", size=3, update=changed, description="The first voxel along each axis")
    box_max: IntVectorProperty(name="To", size=3, update=changed, default=(63, 63, 63),
                               description="The last voxel along each axis")
    use_frames: BoolProperty(name="Only Some Frames", update=changed,
                             description="Decode only a range of the frames of a sequence")
    frame_first: IntProperty(name="First", min=0, max=LARGEST, update=changed, description="The first frame")
    frame_last: IntProperty(name="Last", min=0, max=LARGEST, update=changed, description="The last frame")


def settings_of(properties):
    box = (*properties.box_min, *properties.box_max) if properties.use_box else None
    frames = (properties.frame_first, properties.frame_last) if properties.use_frames else None
    return Settings(properties.layers or None, properties.max_ellipsoids or None, box, frames)


def remember(properties, source, settings):
    """Stores a source, as the text that is shown, and the settings that it was decoded with."""
    properties.source = source
    properties.layers = settings.layers or 0
    properties.max_ellipsoids = settings.max_ellipsoids or 0
    properties.use_box = settings.box is not None
    if settings.box:
        properties.box_min, properties.box_max = settings.box[:3], settings.box[3:]
    properties.use_frames = settings.frames is not None
    if settings.frames:
        properties.frame_first, properties.frame_last = settings.frames


def is_ours(volume):
    """True for a volume that was imported and can be changed."""
    return bool(volume.esvr.source) and volume.library is None


def source_of(volume):
    return Source(preferences.absolute(volume.esvr.source, volume.library))


def request_of(volume):
    return Request(source_of(volume), settings_of(volume.esvr), preferences.cache_root(), preferences.decoder())


def shown_folder(volume):
    return os.path.dirname(preferences.absolute(volume.filepath, volume.library))


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


STATE_SECONDS = 2.0  # for which a state is shown before the files are looked at again; panels are drawn very often

states = {}  # the time and the state by what is shown


def shown_state_of(volume):
    key = (volume.name, volume.filepath, volume.esvr.source, settings_of(volume.esvr))
    now = time.monotonic()
    if key not in states or now - states[key][0] > STATE_SECONDS:
        states.clear()
        states[key] = (now, state_of(volume))
    return states[key][1]


class DATA_PT_esvr(bpy.types.Panel):
    bl_label = "ESVR"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "data"

    @classmethod
    def poll(cls, context):
        volume = getattr(context, "volume", None)
        return volume is not None and bool(volume.esvr.source)

    def draw(self, context):
        layout, properties = self.layout, context.volume.esvr
        layout.use_property_split = True
        layout.prop(properties, "source")
        layout.prop(properties, "layers")
        layout.prop(properties, "max_ellipsoids")
        layout.prop(properties, "use_box")
        if properties.use_box:
            layout.prop(properties, "box_min")
            layout.prop(properties, "box_max")
        layout.prop(properties, "use_frames")
        if properties.use_frames:
            layout.prop(properties, "frame_first")
            layout.prop(properties, "frame_last")
        layout.label(text=shown_state_of(context.volume))
        layout.operator("esvr.reload", icon="FILE_REFRESH").names = context.volume.name


def register():
    bpy.utils.register_class(ESVRVolumeProperties)
    bpy.types.Volume.esvr = PointerProperty(type=ESVRVolumeProperties)
    bpy.utils.register_class(DATA_PT_esvr)
    bpy.app.handlers.load_post.append(reload_after_load)


def unregister():
    bpy.app.handlers.load_post.remove(reload_after_load)
    if bpy.app.timers.is_registered(reload_waiting):
        bpy.app.timers.unregister(reload_waiting)
    bpy.utils.unregister_class(DATA_PT_esvr)
    del bpy.types.Volume.esvr
    bpy.utils.unregister_class(ESVRVolumeProperties)
