"""Imports VDB files into Blender and writes what Blender knows of them as JSON.

    blender --background --factory-startup --python import_facts.py -- OUT.json FILE.vdb...

A file name with a hash sign, such as smoke.####.vdb, is imported as a sequence with all of its
files. The facts of a volume are the same for two files if Blender shows the same grids in the same
places. Values of voxels are not accessible in Blender 3.4; the surface of a grid, which Blender
makes with the modifier Volume to Mesh, stands for them.
"""
import glob
import json
import os
import sys

import bpy

SURFACE_VALUE = 0.4


def matrix_rows(matrix):
    return [list(row) for row in matrix]


def import_volume(path):
    """Imports a file, or all files of a sequence, and returns the object."""
    folder, name = os.path.split(path)
    pattern = os.path.join(glob.escape(folder), name.replace("#", "[0-9]"))
    files = sorted(glob.glob(pattern)) if "#" in name else [path]
    bpy.ops.object.volume_import(
        filepath=files[0],
        directory=folder,
        files=[{"name": os.path.basename(file)} for file in files],
        use_sequence_detection=True,
        align="WORLD",
        location=(0, 0, 0))
    return bpy.context.object


def surface_vertices(volume, grid_name):
    """Vertices, in world space, of the surface on which a grid has the value SURFACE_VALUE."""
    mesh = bpy.data.objects.new("surface", bpy.data.meshes.new("surface"))
    bpy.context.scene.collection.objects.link(mesh)
    modifier = mesh.modifiers.new("surface", "VOLUME_TO_MESH")
    modifier.object = volume
    modifier.grid_name = grid_name
    modifier.resolution_mode = "GRID"
    modifier.threshold = SURFACE_VALUE
    evaluated = mesh.evaluated_get(bpy.context.evaluated_depsgraph_get())
    vertices = [tuple(vertex.co) for vertex in evaluated.data.vertices]
    bpy.data.objects.remove(mesh)
    return vertices


def surface_facts(volume, grid_name):
    vertices = surface_vertices(volume, grid_name)
    if not vertices:
        return None
    axes = list(zip(*vertices))
    return {
        "vertices": len(vertices),
        "min": [min(axis) for axis in axes],
        "max": [max(axis) for axis in axes],
        "center": [sum(axis) / len(vertices) for axis in axes],
    }


def grid_facts(volume, grid):
    return {
        "name": grid.name,
        "data_type": grid.data_type,
        "channels": grid.channels,
        "matrix_object": matrix_rows(grid.matrix_object),
        "loads": grid.load(),
        "surface": surface_facts(volume, grid.name) if grid.channels == 1 else None,
    }


def frame_facts(volume, frame):
    """The file that a sequence shows in a frame of the scene."""
    bpy.context.scene.frame_set(frame)
    shown = volume.evaluated_get(bpy.context.evaluated_depsgraph_get())
    shown.data.grids.load()
    return {
        "frame": frame,
        "file": os.path.basename(shown.data.grids.frame_filepath),
        "error": shown.data.grids.error_message,
        "bound_box": [list(corner) for corner in shown.bound_box],
    }


def sequence_facts(volume):
    data = volume.data
    frames = range(data.frame_start, data.frame_start + data.frame_duration)
    return {
        "is_sequence": data.is_sequence,
        "frame_start": data.frame_start,
        "frame_duration": data.frame_duration,
        "frame_offset": data.frame_offset,
        "frames": [frame_facts(volume, frame) for frame in frames] if data.is_sequence else [],
    }


def facts_of(volume):
    volume.data.grids.load()
    bpy.context.view_layer.update()
    grids = volume.data.grids
    return {
        "error": grids.error_message,
        "is_loaded": grids.is_loaded,
        "grids": [grid_facts(volume, grid) for grid in grids],
        "matrix_world": matrix_rows(volume.matrix_world),
        "bound_box": [list(corner) for corner in volume.bound_box],
        "dimensions": list(volume.dimensions),
        "velocity_grid": volume.data.velocity_grid,
        "sequence": sequence_facts(volume),
    }


def main():
    arguments = sys.argv[sys.argv.index("--") + 1:]
    facts = [facts_of(import_volume(path)) for path in arguments[1:]]
    with open(arguments[0], "w", encoding="utf-8") as file:
        json.dump(facts, file, indent=1)


if __name__ == "__main__":
    main()
