# SPDX-License-Identifier: GPL-3.0-or-later
"""What a volume remembers of its .esvr file: the source and the settings of the decoder."""
import bpy
from bpy.props import BoolProperty, IntProperty, IntVectorProperty, PointerProperty, StringProperty

from . import watch
from .cache import Settings

LARGEST = 2**31 - 1


def changed(self, context):
    watch.schedule(self.id_data.name)


class ESVRVolumeProperties(bpy.types.PropertyGroup):
    source: StringProperty(
        name="Source", subtype="FILE_PATH", update=changed,
        description="The .esvr file; a pattern such as smoke.####.esvr stands for the numbered files of a sequence")
    layers: IntProperty(
        name="Level of Detail", min=0, update=changed,
        description="Decode only this many importance layers of each grid, from the first; 0 decodes all")
    max_ellipsoids: IntProperty(
        name="Max Ellipsoids", min=0, update=changed,
        description="Decode only this many ellipsoids of each grid, those of the largest weight; 0 decodes all")
    use_box: BoolProperty(name="Only a Box", update=changed, description="Decode only the voxels of a box")
    box_min: IntVectorProperty(name="From", size=3, update=changed, description="The first voxel along each axis")
    box_max: IntVectorProperty(name="To", size=3, update=changed, default=(63, 63, 63),
                               description="The last voxel along each axis")
    use_frames: BoolProperty(name="Only Some Frames", update=changed,
                             description="Decode only a range of the frames of a sequence")
    frame_first: IntProperty(name="First", min=0, max=LARGEST, update=changed, description="The first frame")
    frame_last: IntProperty(name="Last", min=0, max=LARGEST, update=changed, description="The last frame")


def settings_of(properties):
    box = (*properties.box_min, *properties.box_max) if properties.use_box else None
    frames = (properties.frame_first, properties.frame_last) if properties.use_frames else None
    return Settings(properties.layers or None, properties.max_ellipsoids or None, box, frames)


def remember(properties, source, settings):
    """Stores a source, as the text that is shown, and the settings that it was decoded with."""
    properties.source = source
    properties.layers = settings.layers or 0
    properties.max_ellipsoids = settings.max_ellipsoids or 0
    properties.use_box = settings.box is not None
    if settings.box:
        properties.box_min, properties.box_max = settings.box[:3], settings.box[3:]
    properties.use_frames = settings.frames is not None
    if settings.frames:
        properties.frame_first, properties.frame_last = settings.frames


def register():
    bpy.utils.register_class(ESVRVolumeProperties)
    bpy.types.Volume.esvr = PointerProperty(type=ESVRVolumeProperties)


def unregister():
    del bpy.types.Volume.esvr
    bpy.utils.unregister_class(ESVRVolumeProperties)
