"""Renders VDB files with Cycles on the CPU and compares the pictures with the first one.

    blender --background --factory-startup --python render_pictures.py -- \\
        OUT.json GRID A.vdb A.exr B.vdb B.exr ...

The pictures have 96 x 96 pixels with 100 samples each and no denoiser, and are written as OpenEXR
with 32-bit floats. If GRID is `density`, the sun shines on the smoke of this grid. Otherwise, the
smoke glows in the colors (v + 1) / 2 of the vectors v of GRID. The camera and the opacity follow
from the bounds of the first file, and are the same for all files. OUT.json has the PSNR in dB, with
a peak of 1, of the other pictures (`psnr`) and of a black picture (`psnr_of_black`).
"""
import json
import math
import sys

import bpy
from mathutils import Vector

DENSITY = "density"
SIDE = 96
SAMPLES = 100
OPTICAL_DEPTH = 40.0  # through the diagonal of the bounds where the density is 1
TOWARDS_CAMERA = Vector((1.0, -2.0, 0.7)).normalized()  # shows three sides
SUN_STRENGTH = 20.0
SUN_ANGLES = (0.6, 0.4, 0.0)


def set_up_cycles(scene):
    scene.render.engine = "CYCLES"
    scene.cycles.device = "CPU"
    scene.cycles.samples = SAMPLES
    scene.cycles.seed = 1
    scene.cycles.use_adaptive_sampling = False
    scene.cycles.use_denoising = False
    scene.world.use_nodes = False
    scene.world.color = (0.0, 0.0, 0.0)


def set_up_picture(scene, side=SIDE):
    scene.render.resolution_x = scene.render.resolution_y = side
    scene.render.resolution_percentage = 100
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"


def import_volume(path):
    bpy.ops.object.volume_import(filepath=path, align="WORLD", location=(0, 0, 0))
    bpy.context.view_layer.update()
    return bpy.context.object


def center_and_diagonal(volume):
    corners = [volume.matrix_world @ Vector(corner) for corner in volume.bound_box]
    low, high = (Vector(map(pick, zip(*corners))) for pick in (min, max))
    return (low + high) / 2, (high - low).length


def attribute(nodes, name):
    node = nodes.new("ShaderNodeAttribute")
    node.attribute_name = name
    return node


def scaled_density(tree, scale):
    node = tree.nodes.new("ShaderNodeMath")
    node.operation = "MULTIPLY"
    node.inputs[1].default_value = scale
    tree.links.new(attribute(tree.nodes, DENSITY).outputs["Fac"], node.inputs[0])
    return node.outputs[0]


def lit_smoke(tree, scale):
    smoke = tree.nodes.new("ShaderNodeVolumePrincipled")
    smoke.inputs["Density"].default_value = scale  # times the grid `density`
    smoke.inputs["Color"].default_value = (0.8, 0.8, 0.8, 1.0)
    return smoke.outputs["Volume"]


def glowing_smoke(tree, scale, grid):
    color = tree.nodes.new("ShaderNodeVectorMath")
    color.operation = "MULTIPLY_ADD"
    color.inputs[1].default_value = color.inputs[2].default_value = (0.5, 0.5, 0.5)
    tree.links.new(attribute(tree.nodes, grid).outputs["Vector"], color.inputs[0])
    glow = tree.nodes.new("ShaderNodeEmission")
    tree.links.new(color.outputs[0], glow.inputs["Color"])
    tree.links.new(scaled_density(tree, scale), glow.inputs["Strength"])
    return glow.outputs["Emission"]


def make_material(diagonal, grid):
    material = bpy.data.materials.new("smoke")
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    scale = OPTICAL_DEPTH / diagonal
    smoke = lit_smoke(tree, scale) if grid == DENSITY else glowing_smoke(tree, scale, grid)
    tree.links.new(smoke, output.inputs["Volume"])
    return material


def add_object(scene, name, data):
    added = bpy.data.objects.new(name, data)
    scene.collection.objects.link(added)
    return added


def add_camera(scene, center, diagonal):
    camera = add_object(scene, "camera", bpy.data.cameras.new("camera"))
    camera.data.type = "ORTHO"
    camera.data.ortho_scale = diagonal
    camera.data.clip_end = 4 * diagonal
    camera.location = center + 2 * diagonal * TOWARDS_CAMERA
    camera.rotation_euler = (-TOWARDS_CAMERA).to_track_quat("-Z", "Y").to_euler()
    scene.camera = camera


def add_sun(scene):
    sun = add_object(scene, "sun", bpy.data.lights.new("sun", "SUN"))
    sun.data.energy = SUN_STRENGTH
    sun.rotation_euler = SUN_ANGLES


def set_up_scene(scene, first, grid):
    """Makes everything but the volume, and returns the material."""
    for data in list(bpy.data.objects):
        bpy.data.objects.remove(data)
    volume = import_volume(first)
    center, diagonal = center_and_diagonal(volume)
    bpy.data.objects.remove(volume)
    add_camera(scene, center, diagonal)
    add_sun(scene)
    return make_material(diagonal, grid)


def render(scene, material, volume, picture):
    """Returns the numbers of all pixels, and removes the volume."""
    volume.data.materials.append(material)
    scene.render.filepath = picture
    bpy.ops.render.render(write_still=True)
    bpy.data.objects.remove(volume)
    return list(bpy.data.images.load(picture).pixels)


def psnr(a, b):
    """Leaves out alpha, which is the last of four numbers, and is at most 120 dB."""
    squares = [(x - y) ** 2 for i, (x, y) in enumerate(zip(a, b)) if i % 4 != 3]
    return -10 * math.log10(max(sum(squares) / len(squares), 1e-12))


def main():
    report, grid, *paths = sys.argv[sys.argv.index("--") + 1:]
    scene = bpy.context.scene
    set_up_cycles(scene)
    set_up_picture(scene)
    material = set_up_scene(scene, paths[0], grid)
    first, *others = [render(scene, material, import_volume(path), picture)
                      for path, picture in zip(paths[::2], paths[1::2])]
    figures = {
        "psnr": [psnr(first, other) for other in others],
        "psnr_of_black": psnr(first, [0.0] * len(first)),
    }
    with open(report, "w", encoding="utf-8") as file:
        json.dump(figures, file, indent=1)


if __name__ == "__main__":
    main()
