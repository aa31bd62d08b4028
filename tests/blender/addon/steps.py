"""What tests of the add-on do within Blender: steps by their names, whose results are printed as JSON.

    blender --background --factory-startup --python steps.py

Each line of the input is a request: `step`, the `arguments` of the function of that name, and `home`, the folder of
the user's cache. `preferences` among the arguments are set first. A step begins with the factory settings.
Errors of operators are results, too; an exception ends Blender.
"""
import json
import os
import sys

import bpy

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
import import_facts  # noqa: E402
import render_pictures  # noqa: E402

ADDON = "esvr_blender"
SIDE, SAMPLES = 96, 16  # of the pictures


def enable(preferences):
    bpy.ops.preferences.addon_enable(module=ADDON)
    for name, value in preferences.items():
        setattr(bpy.context.preferences.addons[ADDON].preferences, name, value)


def call(operator, **arguments):
    """The texts of the errors of an operator; empty if there is none."""
    try:
        operator(**arguments)
    except RuntimeError as error:
        return str(error)
    return ""


def import_esvr(path, **options):
    error = call(bpy.ops.import_volume.esvr, filepath=path, **options)
    return None if error else bpy.context.object


def shown(volume):
    """What the properties of a volume say."""
    data = volume.data
    return {"name": volume.name, "file": bpy.path.abspath(data.filepath), "stored": data.filepath,
            "source": data.esvr.source, "is_sequence": data.is_sequence}


def install(zip_file):
    bpy.ops.preferences.addon_install(filepath=zip_file)
    bpy.ops.preferences.addon_enable(module=ADDON)
    bpy.ops.preferences.addon_disable(module=ADDON)
    return {"menu": hasattr(bpy.types, "IMPORT_VOLUME_OT_esvr"), "property": hasattr(bpy.types.Volume, "esvr")}


def facts(esvr, vdb, options):
    """The facts of the import of an .esvr file, and of the .vdb file of esvr2vdb."""
    volume = import_esvr(esvr, **options)
    return {"esvr": import_facts.facts_of(volume), "vdb": import_facts.facts_of(import_facts.import_volume(vdb)),
            "shown": shown(volume)}


def picture(shown, camera_of, output):
    """The numbers of a picture of a file, .vdb or .esvr, from the camera that is placed for a .vdb file."""
    render_pictures.SIDE, render_pictures.SAMPLES = SIDE, SAMPLES
    scene = bpy.context.scene
    render_pictures.set_up_cycles(scene)
    render_pictures.set_up_picture(scene)
    material = render_pictures.set_up_scene(scene, camera_of, render_pictures.DENSITY)
    volume = import_esvr(shown) if shown.endswith(".esvr") else import_facts.import_volume(shown)
    volume.name = volume.data.name = "shown"  # Cycles draws another name with other random numbers
    return render_pictures.render(scene, material, volume, output)


def chosen_files(folder, names):
    """Files that are chosen together in the file browser."""
    bpy.ops.import_volume.esvr(filepath=os.path.join(folder, names[0]), directory=folder,
                               files=[{"name": name} for name in names])
    return [{**shown(volume), "sequence": import_facts.sequence_facts(volume)}
            for volume in bpy.data.objects if volume.type == "VOLUME"]


def change(esvr, settings):
    """Imports a file, changes settings of the volume and reloads it."""
    volume = import_esvr(esvr)
    before = {**shown(volume), **import_facts.facts_of(volume)}
    bpy.ops.esvr.reload()
    unchanged = shown(volume)["file"]
    for name, value in settings.items():
        setattr(volume.data.esvr, name, value)
    error = call(bpy.ops.esvr.reload)
    return {"before": before, "unchanged": unchanged, "after": {**shown(volume), **import_facts.facts_of(volume)},
            "error": error}


def open_again(esvr, other, blend):
    """Saves a file with a volume, replaces its source by another file, and opens it."""
    bpy.ops.wm.save_as_mainfile(filepath=blend)
    volume = import_esvr(esvr)
    before = {**shown(volume), **import_facts.facts_of(volume)}
    bpy.ops.wm.save_mainfile()
    os.replace(other, esvr)
    bpy.ops.wm.open_mainfile(filepath=blend)
    volume = bpy.context.object
    return {"before": before, "after": {**shown(volume), **import_facts.facts_of(volume)}}


def open_without_source(esvr, blend):
    volume = import_esvr(esvr)
    bpy.ops.wm.save_as_mainfile(filepath=blend)
    os.remove(esvr)
    bpy.ops.wm.open_mainfile(filepath=blend)
    volume = bpy.context.object
    return {"grids": len(import_facts.facts_of(volume)["grids"]), "error": call(bpy.ops.esvr.reload)}


def export(vdb, esvr, options, frames=None):
    """`frames` is the number of frames, because Blender's import ends a sequence at the first gap."""
    volume = import_facts.import_volume(vdb)
    if frames:
        volume.data.frame_duration = frames
    return {"error": call(bpy.ops.export_volume.esvr, filepath=esvr, **options)}


def export_nothing(esvr):
    bpy.ops.object.volume_add()
    return {"error": call(bpy.ops.export_volume.esvr, filepath=esvr)}


def refused(esvr):
    """The error of an import, and what is left of it."""
    error = call(bpy.ops.import_volume.esvr, filepath=esvr)
    return {"error": error, "volumes": len(bpy.data.volumes)}


def clear(esvr):
    """Decodes with two settings, and clears the cache while the second one is shown."""
    volume = import_esvr(esvr)
    first = shown(volume)["file"]
    volume.data.esvr.max_ellipsoids = 5
    bpy.ops.esvr.reload()
    bpy.ops.esvr.clear_cache()
    return {"first": os.path.exists(first), "second": os.path.exists(shown(volume)["file"])}


def unregister():
    bpy.ops.preferences.addon_disable(module=ADDON)
    left = [name for name in dir(bpy.types) if "esvr" in name.lower()]
    handlers = [function.__module__ for function in bpy.app.handlers.load_post]
    return {"left": left, "property": hasattr(bpy.types.Volume, "esvr"), "handlers": handlers}


def main():
    for line in sys.stdin:
        request = json.loads(line)
        os.environ["XDG_CACHE_HOME"] = request["home"]
        bpy.ops.wm.read_factory_settings()
        preferences = request["arguments"].pop("preferences", None)
        if preferences is not None:
            enable(preferences)
        result = globals()[request["step"]](**request["arguments"])
        print("result of the step: " + json.dumps(result), flush=True)


main()
