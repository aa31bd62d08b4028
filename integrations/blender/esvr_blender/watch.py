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


def register():
    bpy.app.handlers.load_post.append(reload_after_load)


def unregister():
    bpy.app.handlers.load_post.remove(reload_after_load)
    if bpy.app.timers.is_registered(reload_waiting):
        bpy.app.timers.unregister(reload_waiting)
