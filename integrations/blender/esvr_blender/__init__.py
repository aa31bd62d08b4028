# SPDX-License-Identifier: GPL-3.0-or-later
"""Imports .esvr files into Blender as volumes, and exports volumes to .esvr files.

Modules without bpy (source, cache, jobs, decode, export) are tested without Blender.
"""
# Blender 4.2 and newer take these facts from blender_manifest.toml if the add-on is installed as an extension.
bl_info = {
    "name": "ESVR Volumes",
    "author": "The ESVR authors",
    "version": (0, 1, 0),
    "blender": (3, 4, 0),
    "location": "File > Import, File > Export, and the data of volumes",
    "description": "Import and export of sparse volumes stored as ellipsoids (.esvr)",
    "category": "Import-Export",
}


def _parts():
    """The modules that register something, in order. Tests of the other modules import this package without bpy."""
    from . import import_export, modal, preferences, volumes
    return preferences, volumes, import_export, modal


def register():
    for part in _parts():
        part.register()


def unregister():
    for part in reversed(_parts()):
        part.unregister()
