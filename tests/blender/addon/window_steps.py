"""What a user sees of the add-on in a window: a settings change decodes again by itself, and Esc cancels.

    blender --factory-startup --enable-event-simulate --python window_steps.py -- ARGUMENTS.json RESULT.json

The arguments are `preferences`, the file `esvr`, and `slow`, a program that stands for esvr2vdb and does not end.
"""
import json
import os
import sys

import bpy

ADDON = "esvr_blender"
TICK_SECONDS, PATIENCE = 0.1, 200  # ticks until a step is given up

with open(sys.argv[-2], encoding="utf-8") as file:
    arguments = json.load(file)
bpy.ops.preferences.addon_enable(module=ADDON)
preferences = bpy.context.preferences.addons[ADDON].preferences
for name, value in arguments["preferences"].items():
    setattr(preferences, name, value)
from esvr_blender import modal, volumes  # noqa: E402 (enabling the add-on makes them known)

result = {}
errors = []  # that are shown in a window
show_error = volumes.show_error


def noted_error(text):
    errors.append(text)
    show_error(text)


volumes.show_error = noted_error


def window():
    return bpy.context.window_manager.windows[0]


def start_import():
    with bpy.context.temp_override(window=window()):
        return list(bpy.ops.import_volume.esvr("EXEC_DEFAULT", filepath=arguments["esvr"]))


def press_escape():
    for value in ("PRESS", "RELEASE"):
        window().event_simulate(type="ESC", value=value, x=200, y=200)


def leftovers():
    return [name for name in os.listdir(preferences.cache_folder) if name.startswith(".")]


def story():
    """Waits where it yields until the condition that it yields is true."""
    result["import"] = start_import()
    yield lambda: bpy.data.volumes and not modal.running
    volume = bpy.data.volumes[0]
    result["first"] = volume.filepath
    volume.esvr.max_ellipsoids = 5
    yield lambda: volume.filepath != result["first"]
    result["second"] = volume.filepath
    preferences.esvr2vdb = arguments["slow"]
    volume.esvr.max_ellipsoids = 6
    yield lambda: modal.running and leftovers()
    result["text"] = modal.running[0].text
    press_escape()
    yield lambda: not modal.running and not leftovers()
    result["third"] = volume.filepath
    volume.esvr.source = arguments["esvr"] + ".missing"
    yield lambda: errors
    result["error"] = errors[0]


def tick(steps=story(), wait=[lambda: True, 0]):
    condition, count = wait
    try:
        if condition():
            wait[:] = [next(steps), 0]
        elif count > PATIENCE:
            raise TimeoutError(result)
        else:
            wait[1] += 1
        return TICK_SECONDS
    except StopIteration:
        with open(sys.argv[-1], "w", encoding="utf-8") as file:
            json.dump(result, file)
    except Exception as error:
        print(repr(error))
    bpy.ops.wm.quit_blender()
    return None


bpy.app.timers.register(tick, first_interval=1.0)
