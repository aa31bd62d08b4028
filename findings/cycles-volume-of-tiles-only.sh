#!/usr/bin/env bash
# Cycles draws nothing of a VDB grid that consists of tiles only; one leaf anywhere brings all tiles back.
#
# Version:   Blender 3.4.1+dfsg-2+b1 (Debian 12) with OpenVDB 10.0.1-2, Cycles on the CPU.
# Input:     a fog volume of eight active tiles of 8^3 voxels with the value 5, which pruning makes of full leaves, and
#            the same with one more voxel of 1e-6 outside the picture.
# Expected:  both pictures show the same glowing block.
# Observed:  the first is black, without a message; the second shows the block.
# Matters:   a tool that prunes constant regions, as OpenVDB recommends, can make a volume invisible. A writer keeps at
#            least one leaf for Cycles.
. "$(dirname "$0")/lib/packages.sh"
debian blender=3.4.1+dfsg-2+b1 python3-openvdb=10.0.1-2
cat >"$work/system/tmp/block.py" <<'P'
import bpy
import pyopenvdb as vdb


def block(path, with_leaf):
    grid = vdb.FloatGrid()
    grid.name, grid.gridClass = 'density', vdb.GridClass.FOG_VOLUME
    grid.fill((0, 0, 0), (15, 15, 15), 5.0)
    grid.prune()
    if with_leaf:
        grid.getAccessor().setValueOn((40, 4, 4), 1e-6)
    vdb.write(path, [grid])


def glow():
    material = bpy.data.materials.new('glow')
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    density = tree.nodes.new('ShaderNodeAttribute')
    density.attribute_name = 'density'
    emission = tree.nodes.new('ShaderNodeEmission')
    output = tree.nodes.new('ShaderNodeOutputMaterial')
    tree.links.new(density.outputs['Fac'], emission.inputs['Strength'])
    tree.links.new(emission.outputs['Emission'], output.inputs['Volume'])
    return material


def brightness(path):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = 'CYCLES'
    scene.cycles.samples = 4
    scene.cycles.use_denoising = False
    scene.render.resolution_x = scene.render.resolution_y = 32
    scene.render.image_settings.file_format = 'OPEN_EXR'
    scene.render.filepath = '/tmp/picture.exr'
    bpy.ops.object.volume_import(filepath=path, align='WORLD', location=(0, 0, 0))
    bpy.context.object.data.materials.append(glow())
    camera = bpy.data.objects.new('camera', bpy.data.cameras.new('camera'))
    camera.location = (8, 8, 60)
    camera.data.type, camera.data.ortho_scale = 'ORTHO', 14
    scene.collection.objects.link(camera)
    scene.camera = camera
    bpy.ops.render.render(write_still=True)
    return max(bpy.data.images.load('/tmp/picture.exr').pixels[:][0::4])


for with_leaf in False, True:
    block('/tmp/block.vdb', with_leaf)
    print('\nseen', 'black' if brightness('/tmp/block.vdb') == 0 else 'visible')
P
mapfile -t seen < <(within blender --background --factory-startup --python /tmp/block.py 2>/dev/null |
  sed -n 's/^seen //p')
observe 'tiles only' "${seen[0]}" black
observe 'tiles and one leaf' "${seen[1]}" visible
exit $differs
