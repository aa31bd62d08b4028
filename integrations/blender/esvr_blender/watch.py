# SPDX-License-Identifier: GPL-3.0-or-later
"""Decodes volumes again after their settings were changed, and if they are not up to date when a file is opened."""
import bpy
from bpy.app.handlers import persistent

from .modal import running

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
            bpy.ops.esvr.reload("INVOKE_DEFAULT", volumes="\n".join(names))
    return None


@persistent
def reload_after_load(*_):
    names = [volume.name for volume in bpy.data.volumes if volume.esvr.source]
    if bpy.app.background and names:
        try:
            bpy.ops.esvr.reload(volumes="\n".join(names))
        except RuntimeError as error:  # the scene is opened all the same
            print(error)
    for name in names:
        schedule(name)


def register():
    bpy.app.handlers.load_post.append(reload_after_load)


def unregister():
    bpy.app.handlers.load_post.remove(reload_after_load)
    if bpy.app.timers.is_registered(reload_waiting):
        bpy.app.timers.unregister(reload_waiting)
