# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel ESVR of the data of a volume."""
import time

import bpy

from . import volumes

STATE_SECONDS = 2.0  # for which a state is shown before the files are looked at again; panels are drawn very often

states = {}  # the time and the state by what is shown


def state_of(volume):
    key = (volume.name, volume.filepath, volume.esvr.source, volumes.settings_of(volume.esvr))
    now = time.monotonic()
    if key not in states or now - states[key][0] > STATE_SECONDS:
        states.clear()
        states[key] = (now, volumes.state_of(volume))
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
        layout.label(text=state_of(context.volume))
        layout.operator("esvr.reload", icon="FILE_REFRESH").volumes = context.volume.name


def register():
    bpy.utils.register_class(DATA_PT_esvr)


def unregister():
    bpy.utils.unregister_class(DATA_PT_esvr)
