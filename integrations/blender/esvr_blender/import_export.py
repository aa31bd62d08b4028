# SPDX-License-Identifier: GPL-3.0-or-later
"""File > Import > ESVR, File > Export > ESVR, and the operators of the panel."""
import os

import bpy
from bpy.props import (BoolProperty, CollectionProperty, EnumProperty, FloatProperty, IntProperty, IntVectorProperty,
                       StringProperty)
from bpy_extras.io_utils import ExportHelper, ImportHelper

from . import cache, preferences, volumes
from .decode import Request, decode
from .export import Export, Goal, Input, export
from .jobs import Job, JobFailed
from .modal import JobOperator
from .preferences import absolute
from .source import EXTENSION, Source, SourceError, grouped, text_of_gaps


def decode_all(job, requests):
    """For each request its entry, or the JobFailed that is the reason why there is none."""
    return [decoded_or_failure(job, request) for request in requests]


def decoded_or_failure(job, request):
    try:
        return decode(job, request)
    except JobFailed as failure:
        return failure


def report_gaps(operator, source, entry):
    """Blender shows nothing in a missing frame, and its own import ends at the first one."""
    text = text_of_gaps(source.stem, entry.frames or [])
    if text:
        operator.report({"WARNING"}, text)


def report_failures(operator, results):
    """Reports the failures among results of decode_all(). Returns whether there is an entry."""
    failures = [result for result in results if isinstance(result, JobFailed)]
    for failure in failures:
        operator.report({"ERROR"}, str(failure))
    return len(failures) < len(results)


def report_left_out(operator, request):
    """Warns of files that look like frames of the source and are none."""
    hint = request.source.hint(request.settings.frames)
    if hint:
        operator.report({"WARNING"}, hint)


class ImportESVR(JobOperator, bpy.types.Operator, ImportHelper):
    """Import .esvr files as volumes"""
    bl_idname = "import_volume.esvr"
    bl_label = "Import ESVR"
    bl_options = {"UNDO"}

    filename_ext = EXTENSION
    filter_glob: StringProperty(default="*" + EXTENSION, options={"HIDDEN"})
    files: CollectionProperty(type=bpy.types.OperatorFileListElement, options={"HIDDEN", "SKIP_SAVE"})
    directory: StringProperty(subtype="DIR_PATH", options={"HIDDEN", "SKIP_SAVE"})
    use_sequence_detection: BoolProperty(
        name="Detect Sequences", default=True,
        description="Chosen files whose names differ in their last number only are the frames of one volume")
    layers: IntProperty(name="Level of Detail", min=0,
                        description="Decode only this many importance layers of each grid; 0 decodes all")
    max_ellipsoids: IntProperty(name="Max Ellipsoids", min=0,
                                description="Decode only this many ellipsoids of each grid; 0 decodes all")
    use_box: BoolProperty(name="Only a Box", description="Decode only the voxels of a box")
    box_min: IntVectorProperty(name="From", size=3, description="The first voxel along each axis")
    box_max: IntVectorProperty(name="To", size=3, default=(63, 63, 63), description="The last voxel along each axis")

    _requests = ()

    @classmethod
    def poll(cls, context):
        return context.mode == "OBJECT"

    def execute(self, context):
        try:
            self._requests = self._make_requests()
        except JobFailed as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        return self.run(context, Job(lambda job: decode_all(job, self._requests)))

    def finish(self, context, result):
        for request, entry in zip(self._requests, result):
            if not isinstance(entry, JobFailed):
                add_volume(context, request, entry)
                report_gaps(self, request.source, entry)
                report_left_out(self, request)
        return report_failures(self, result)

    def _paths(self):
        names = [file.name for file in self.files if file.name]
        return [os.path.join(self.directory, name) for name in names] or [self.filepath]

    def _make_requests(self):
        paths = [absolute(path) for path in self._paths()]
        found = grouped(paths) if self.use_sequence_detection else ((Source(path), None) for path in paths)
        root, decoder = preferences.cache_root(), preferences.decoder()
        box = (*self.box_min, *self.box_max) if self.use_box else None
        return [Request(source, cache.Settings(self.layers or None, self.max_ellipsoids or None, box, frames), root,
                        decoder) for source, frames in found]


def add_volume(context, request, entry):
    """Adds an object as File > Import > OpenVDB does, which turns volumes of Houdini, and remembers the source."""
    files = [{"name": name} for name in sorted(entry.files.values())]
    bpy.ops.object.volume_import(filepath=entry.first, directory=entry.folder + os.sep, files=files,
                                 use_sequence_detection=bool(entry.frames))
    added = context.view_layer.objects.active
    added.name = added.data.name = request.source.stem
    volumes.remember(added.data.esvr, volumes.relative_if_wanted(request.source.text), request.settings)
    volumes.show(added.data, entry)


class ReloadESVR(JobOperator, bpy.types.Operator):
    """Decode volumes again whose source or settings have changed"""
    bl_idname = "esvr.reload"
    bl_label = "Reload"
    bl_options = {"UNDO"}

    names: StringProperty(description="Names of volumes on lines of their own; that of the active object if empty",
                          options={"HIDDEN", "SKIP_SAVE"})

    _changed = ()

    def execute(self, context):
        requests = {}
        for volume in self._wanted(context):
            try:
                if not volumes.is_current(volume):
                    requests[volume.name] = volumes.request_of(volume)
            except (JobFailed, SourceError, OSError) as error:
                self.report({"ERROR"}, f"{volume.name}: {error}")
        if not requests:
            return {"FINISHED"}
        for request in requests.values():
            report_left_out(self, request)
        self._changed = list(requests)  # names, because a volume may be removed in the meantime
        return self.run(context, Job(lambda job: decode_all(job, requests.values())))

    def finish(self, context, result):
        for name, entry in zip(self._changed, result):
            if name in bpy.data.volumes and not isinstance(entry, JobFailed):
                volumes.show(bpy.data.volumes[name], entry)
        return report_failures(self, result)

    def _wanted(self, context):
        names = self.names.split("\n") if self.names else []
        active = context.active_object
        if not names and active and active.type == "VOLUME":
            names = [active.data.name]
        known = [bpy.data.volumes[name] for name in names if name in bpy.data.volumes]
        return [volume for volume in known if volumes.is_ours(volume)]


class ClearESVRCache(bpy.types.Operator):
    """Remove the decoded files that no volume of this .blend file shows. Other .blend files decode theirs again"""
    bl_idname = "esvr.clear_cache"
    bl_label = "Clear Cache"

    def execute(self, context):
        try:
            root = preferences.cache_root()
        except JobFailed as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        used = [volumes.shown_folder(volume) for volume in bpy.data.volumes if volume.filepath]
        self.report({"INFO"}, f"{cache.remove_others(root, used)} folders removed from {root}")
        return {"FINISHED"}

    def invoke(self, context, event):
        return context.window_manager.invoke_confirm(self, event)


GOALS = [
    ("PRESET", "Preset", "The quality of a preset"),
    ("PSNR", "PSNR", "The smallest file that reaches a PSNR over the box"),
    ("MAX_ERROR", "Max Error", "No voxel differs by more than this share of the range of values"),
    ("SIZE", "Size", "The best file of at most this size"),
    ("RATIO", "Ratio", "The best file of at most the size of the .vdb files divided by this number"),
    ("LOSSLESS", "Lossless", "All voxels bit for bit"),
]


class ExportESVR(JobOperator, bpy.types.Operator, ExportHelper):
    """Export the .vdb files of the active volume to an .esvr file"""
    bl_idname = "export_volume.esvr"
    bl_label = "Export ESVR"

    filename_ext = EXTENSION
    filter_glob: StringProperty(default="*" + EXTENSION, options={"HIDDEN"})
    goal: EnumProperty(name="Goal", items=GOALS, default="PRESET")
    preset: EnumProperty(name="Preset", default="standard", items=[
        ("draft", "Draft", "32 dB over the active voxels"),
        ("standard", "Standard", "40 dB over the active voxels"),
        ("high", "High", "50 dB over the active voxels")])
    psnr: FloatProperty(name="PSNR (dB)", default=45.0, min=1.0, max=200.0)
    max_error: FloatProperty(name="Max Error (%)", default=1.0, min=1e-6, max=100.0, precision=4)
    size: FloatProperty(name="Size (KB)", default=100.0, min=0.1)
    ratio: FloatProperty(name="Ratio", default=50.0, min=1.0)
    topology: EnumProperty(name="Active Voxels", default="auto", items=[
        ("auto", "By Value", "Those whose values differ from the background by more than the error"),
        ("exact", "Exact", "Exactly those of the source, by a mask")])
    representation: EnumProperty(name="Stored as", default="auto", items=[
        ("auto", "Automatic", "Ellipsoids or voxels, whichever are better"),
        ("ellipsoids", "Ellipsoids", "Ellipsoids"),
        ("voxels", "Voxels", "Quantised voxels")])

    @classmethod
    def poll(cls, context):
        return context.active_object is not None and context.active_object.type == "VOLUME"

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        layout.prop(self, "goal")
        if self.goal != "LOSSLESS":
            layout.prop(self, self.goal.lower())
            layout.prop(self, "topology")
            layout.prop(self, "representation")

    def execute(self, context):
        try:
            wanted = Export(preferences.exporter(), input_of(context.active_object.data),
                            absolute(self.filepath), self._goal(), self.topology, self.representation)
        except JobFailed as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        return self.run(context, Job(lambda job: export(job, wanted)))

    def finish(self, context, result):
        if result:
            self.report({"WARNING"}, result)
        path = absolute(self.filepath)
        self.report({"INFO"}, f"{path}: {os.path.getsize(path):,} bytes")
        return True

    def _goal(self):
        return {
            "PRESET": Goal("--preset", self.preset),
            "PSNR": Goal("--psnr", f"{self.psnr:.6g}"),
            "MAX_ERROR": Goal("--max-error", f"{self.max_error:.6g}%"),
            "SIZE": Goal("--size", str(round(1000 * self.size))),
            "RATIO": Goal("--ratio", f"{self.ratio:.6g}"),
            "LOSSLESS": Goal("--lossless"),
        }[self.goal]


def input_of(volume):
    """The files of a volume."""
    if not volume.filepath:
        raise JobFailed(f"The volume '{volume.name}' has no .vdb file")
    path = absolute(volume.filepath, volume.library)
    if not volume.is_sequence:
        return Input(path)
    return Input(path, (volume.frame_offset + 1, volume.frame_offset + volume.frame_duration))


def import_entry(self, context):
    self.layout.operator(ImportESVR.bl_idname, text=f"ESVR ({EXTENSION})")


def export_entry(self, context):
    self.layout.operator(ExportESVR.bl_idname, text=f"ESVR ({EXTENSION})")


CLASSES = (ImportESVR, ReloadESVR, ClearESVRCache, ExportESVR)


def register():
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.TOPBAR_MT_file_import.append(import_entry)
    bpy.types.TOPBAR_MT_file_export.append(export_entry)


def unregister():
    bpy.types.TOPBAR_MT_file_export.remove(export_entry)
    bpy.types.TOPBAR_MT_file_import.remove(import_entry)
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
