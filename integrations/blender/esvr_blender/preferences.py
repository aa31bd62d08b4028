# SPDX-License-Identifier: GPL-3.0-or-later
"""What the user sets once: where decoded files are kept, and which decoder makes them."""
import os

import bpy
from bpy.props import EnumProperty, StringProperty

from . import cache, decode, export
from .jobs import JobFailed, find_program

CACHE_BESIDE_BLEND = "esvr_cache"


class ESVRPreferences(bpy.types.AddonPreferences):
    bl_idname = __package__

    cache_place: EnumProperty(
        name="Cache",
        description="Where decoded .vdb files are kept",
        items=[("BLEND", "Beside the .blend File",
                f"In the folder {CACHE_BESIDE_BLEND} beside the .blend file; before it is saved, in the user's cache"),
               ("USER", "User's Cache", "In a folder of the user, for all .blend files"),
               ("FOLDER", "Folder", "In the folder below")],
        default="BLEND")
    cache_folder: StringProperty(name="Folder", subtype="DIR_PATH", description="The folder of the cache")
    decoder: EnumProperty(
        name="Decoder",
        description="What decodes .esvr files; both give the same voxels",
        items=[("AUTO", "Automatic", "The Python module if Blender's Python has it, otherwise esvr2vdb"),
               ("MODULE", "Python Module", "The Python module esvr"),
               ("PROGRAM", "Program", "The program esvr2vdb")],
        default="AUTO")
    esvr2vdb: StringProperty(name="esvr2vdb", subtype="FILE_PATH",
                             description="The program that decodes; if empty, it is looked for in PATH")
    vdb2esvr: StringProperty(name="vdb2esvr", subtype="FILE_PATH",
                             description="The program that exports; if empty, it is looked for in PATH")

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        layout.prop(self, "cache_place")
        if self.cache_place == "FOLDER":
            layout.prop(self, "cache_folder")
        layout.prop(self, "decoder")
        layout.prop(self, "esvr2vdb")
        layout.prop(self, "vdb2esvr")
        layout.operator("esvr.clear_cache")


def get():
    return bpy.context.preferences.addons[__package__].preferences


def absolute(path):
    return os.path.abspath(bpy.path.abspath(path)) if path else ""


def cache_root():
    """The folder of the cache. Raises JobFailed if none is set."""
    preferences = get()
    if preferences.cache_place == "FOLDER":
        if not preferences.cache_folder:
            raise JobFailed("Set the folder of the cache in the preferences of the add-on")
        return absolute(preferences.cache_folder)
    if preferences.cache_place == "BLEND" and bpy.data.filepath:
        return os.path.join(os.path.dirname(bpy.data.filepath), CACHE_BESIDE_BLEND)
    return cache.user_folder()


def decoder():
    """The decoder that the user has chosen. Raises JobFailed if it is not there."""
    preferences = get()
    module = decode.esvr_module() if preferences.decoder != "PROGRAM" else None
    if module:
        return decode.ModuleDecoder(module)
    if preferences.decoder == "MODULE":
        raise JobFailed("Blender's Python does not have the module esvr")
    return decode.ProgramDecoder(find_program(decode.PROGRAM, absolute(preferences.esvr2vdb)))


def exporter():
    return find_program(export.PROGRAM, absolute(get().vdb2esvr))


def register():
    bpy.utils.register_class(ESVRPreferences)


def unregister():
    bpy.utils.unregister_class(ESVRPreferences)
