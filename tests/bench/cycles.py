"""Draws volumes with Cycles at densities that are given. calibration.py runs it in Blender:

    blender --background --factory-startup --python cycles.py -- JOB.json

JOB.json has the `side` of the square pictures and a list of `pictures`. Each of these has a `volume`, a VDB file with a
grid "density" and voxels of side 1, the `density` by which its values are multiplied, a `seed`, the `samples` of a pixel,
and `out`, a file for numpy.load: the red, green and blue light of all pixels, from the lowest row to the top one. Sun and
material are those of the tests (tests/blender/render_pictures.py). The camera looks from the same direction, and the
first volume fills the picture.
"""
import json
import pathlib
import sys

import bpy
import numpy as np
from mathutils import Vector

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "blender"))
import render_pictures as cycles  # noqa: the path must be known first

MARGIN = 1.02


def fill_picture(scene, volume):
    """Sets the width that the camera sees to that of the bounds."""
    turned = scene.camera.matrix_world.to_3x3().inverted()
    corners = [turned @ (volume.matrix_world @ Vector(corner)) for corner in volume.bound_box]
    scene.camera.data.ortho_scale = MARGIN * max(max(c[axis] for c in corners) - min(c[axis] for c in corners)
                                                 for axis in (0, 1))


def main():
    job = json.loads(pathlib.Path(sys.argv[-1]).read_text())
    scene = bpy.context.scene
    cycles.set_up_cycles(scene)
    cycles.set_up_picture(scene, job["side"])
    scene.render.threads_mode, scene.render.threads = "FIXED", 1
    first = job["pictures"][0]["volume"]
    material = cycles.set_up_scene(scene, first, cycles.DENSITY)
    bounds = cycles.import_volume(first)
    fill_picture(scene, bounds)
    bpy.data.objects.remove(bounds)
    density = next(node for node in material.node_tree.nodes if node.bl_idname == "ShaderNodeVolumePrincipled").inputs["Density"]
    for picture in job["pictures"]:
        scene.cycles.seed, scene.cycles.samples = picture["seed"], picture["samples"]
        density.default_value = picture["density"]
        exr = picture["out"] + ".exr"
        pixels = cycles.render(scene, material, cycles.import_volume(picture["volume"]), exr)
        pathlib.Path(exr).unlink()
        np.save(picture["out"], np.array(pixels, np.float32).reshape(job["side"], job["side"], 4)[..., :3])


if __name__ == "__main__":
    main()
