"""Reader of DICOM: a series of slices in a file each, or of frames in one file."""
import os

import numpy as np

import esvr

from .image import LPS_TO_RAS, TIME, Axis, Image, affine_of, natural, need, product, reading, require_bytes

EVEN = 0.01  # by this share of a slice, distances of slices may differ
TIMES = ("TemporalPositionIdentifier", "TemporalPositionIndex", "TriggerTime", "AcquisitionNumber", "EchoTime",
         "DiffusionBValue", "AcquisitionTime", "ContentTime", "InstanceNumber")


def is_dicom(path):
    with open(path, "rb") as file:
        head = file.read(132)
    # Files of old programs have no preamble and begin with one of the first elements of the group 8.
    begins = head[:2] == b"\x08\0" and head[3:4] == b"\0" and head[2:3] in b"\0\1\5\x08\x12\x14\x16\x18"
    return head[128:] == b"DICM" or begins and (head[4:6] in (b"CS", b"UI", b"UL") or 0 < int.from_bytes(head[4:8], "little") <= 64)


class Frame:
    """A slice: its file, its place in it, and what the header says of it."""

    def __init__(self, path, header, number, shared, own):
        self.path, self.header, self.number = path, header, number
        groups = [own, shared, header]

        def find(sequence, name):
            for group in groups:
                if group is None:
                    continue
                within = group.get(sequence)
                value = (within[0] if within else group).get(name) if group is not header or not within else group.get(name)
                if value is not None:
                    return value
            return None
        self.position = find("PlanePositionSequence", "ImagePositionPatient")
        self.orientation = find("PlaneOrientationSequence", "ImageOrientationPatient")
        self.spacing = find("PixelMeasuresSequence", "PixelSpacing") or header.get("ImagerPixelSpacing")
        slope = find("PixelValueTransformationSequence", "RescaleSlope")
        intercept = find("PixelValueTransformationSequence", "RescaleIntercept")
        if header.get("DoseGridScaling") is not None:
            slope, intercept = header.DoseGridScaling, 0
        self.scale = (float(1 if slope is None else slope), float(intercept or 0))
        offsets = header.get("GridFrameOffsetVector")
        if offsets is not None and self.position is not None and self.orientation is not None and len(offsets) > number:
            step = float(offsets[number]) - (float(offsets[0]) if offsets[0] == self.position[2] else 0.0)
            self.position = np.array(self.position, float) + step * self.normal()
        self.times = tuple(as_number(find("FrameContentSequence", name)) for name in TIMES) + (number,)
        self.name = path if number == 0 and own is None else f"{path} (frame {number + 1})"

    def normal(self):
        along = np.array(self.orientation, float)
        return np.cross(along[:3], along[3:])

    def height(self):
        return float(np.dot(np.array(self.position, float), self.normal()))


def as_number(value):
    try:
        return float(value)
    except (TypeError, ValueError):
        return -1.0


def frames_of(path, header):
    count = int(header.get("NumberOfFrames") or 1)
    shared = header.get("SharedFunctionalGroupsSequence")
    own = header.get("PerFrameFunctionalGroupsSequence")
    if own is not None and len(own) != count:
        raise esvr.BadInput(f"{path} describes {len(own)} frames, and has {count}")
    return [Frame(path, header, k, shared[0] if shared else None, own[k] if own else None) for k in range(count)]


def read_dicom(paths, options, folder=None):
    """The series of some files. folder is what messages name, if the files are those of a folder."""
    pydicom = need("pydicom", "python3-pydicom", paths[0], "DICOM")
    series, where = {}, folder or paths[0]
    for path in paths:
        with reading(path, "DICOM"):
            header = pydicom.dcmread(path, stop_before_pixels=True, force=not is_preamble(path))
            list(header)  # the elements are decoded when they are asked for
        if "Rows" not in header:  # a directory, a report
            continue
        if str(header.get("Modality")) == "SEG":
            raise esvr.BadInput(f"{path} is a DICOM segmentation, which is not read; save it as Seg.nrrd or NIfTI")
        series.setdefault(str(header.get("SeriesInstanceUID", "")), []).append((path, header))
    if not series:
        raise esvr.BadInput(f"{where} has no DICOM image")
    with reading(where, "DICOM"):
        return image_of_series(where, chosen_series(where, series, options), options)


def image_of_series(where, files, options):
    header = files[0][1]
    for path, other in files:
        for name in ("Rows", "Columns", "SamplesPerPixel", "BitsAllocated", "PixelRepresentation", "PhotometricInterpretation"):
            if other.get(name) != header.get(name):
                raise esvr.BadInput(f"{path} has {name} {other.get(name)}, and {files[0][0]} has {header.get(name)}; slices of one "
                                    "image have one size and type")
    return image_of(where, header, [frame for path, other in files for frame in frames_of(path, other)], options)


def is_preamble(path):
    with open(path, "rb") as file:
        return file.read(132)[128:] == b"DICM"


def chosen_series(where, series, options):
    """The files of the series that --dataset names by its number or UID."""
    if options.dataset is not None:
        found = [files for uid, files in series.items() if options.dataset in (uid, str(files[0][1].get("SeriesNumber", "")))]
        if len(found) == 1:
            return found[0]
    elif len(series) == 1:
        return next(iter(series.values()))
    shown = "; ".join(f"{files[0][1].get('SeriesNumber') or uid} ({files[0][1].get('SeriesDescription') or 'no description'}, "
                      f"{len(files)} files)" for uid, files in series.items())
    numbers = {str(files[0][1].get("SeriesNumber") or uid) for uid, files in series.items()}
    by = "its number" if len(numbers) == len(series) else f"its UID ({', '.join(series)})"
    raise esvr.UsageError(f"{where} has {len(series)} series: {shown}; name one by --dataset and {by}")


# -- geometry --------------------------------------------------------------------------------------------------------
def image_of(where, header, frames, options):
    samples, warnings = int(header.get("SamplesPerPixel", 1)), []
    if samples > 1 and header.PhotometricInterpretation != "RGB":
        raise esvr.BadInput(f"{where} has colors as {header.PhotometricInterpretation}, which is not read; RGB is")
    if header.get("ModalityLUTSequence") and not options.stored:
        raise esvr.BadInput(f"{where} has values that a table calibrates, which is not read; --stored takes the stored numbers")
    placed = [frame for frame in frames if frame.position is not None and frame.orientation is not None]
    if len(placed) not in (0, len(frames)):
        without = next(frame for frame in frames if frame not in placed)
        raise esvr.BadInput(f"{without.name} has no position, and other slices have")
    rows = [float(n) for n in frames[0].spacing or (1, 1)]  # the distance of rows is the first number
    if frames[0].spacing is None:
        warnings.append("the file has no pixel spacing, so that edges are 1")
    for frame in frames[1:]:
        if frame.spacing is not None and not np.allclose([float(n) for n in frame.spacing], rows):
            raise esvr.BadInput(f"{frame.name} has the pixel spacing {list(frame.spacing)}, and {frames[0].name} has {rows}")
    if placed:
        volumes, affine = stacked(where, placed, rows, options)
    else:
        volumes, affine = [sorted(frames, key=lambda f: (as_number(f.header.get("InstanceNumber")), natural(f.path), f.number))], \
            affine_of([rows[1], rows[0], float(header.get("SpacingBetweenSlices") or 1)])
        if len(frames) > 1 and len({frame.path for frame in frames}) == 1:
            volumes = [[frame] for frame in volumes[0]]  # frames of a film
        elif len(frames) > 1:
            warnings.append("the slices have no positions; they are in the order of their instance numbers, and their distance is "
                            f"{affine[2, 2]:g}")
    pages = Frames(volumes, samples, options)
    axes = ([Axis(TIME, len(volumes))] if len(volumes) > 1 else []) + [
        Axis("z", len(volumes[0])), Axis("y", int(header.Rows)), Axis("x", int(header.Columns))]
    if samples > 1:
        axes.append(Axis("sample", samples))
    known = frames[0].spacing is not None
    image = Image("DICOM", where, axes, pages.dtype, pages, LPS_TO_RAS @ affine, "mm" if known else None,
                  pages.common_scale, pages.missing(), warnings=warnings,
                  metadata={"image_space": "left-posterior-superior"} if placed else {})
    if header.get("RescaleType"):
        image.metadata["value_unit"] = str(header.RescaleType)
    return image


def stacked(where, frames, rows, options):
    """The volumes (one for each time) of sorted slices, and the matrix."""
    first = frames[0]
    along = np.array(first.orientation, float)
    for frame in frames[1:]:
        if not np.allclose(np.array(frame.orientation, float), along, atol=1e-3):
            raise esvr.BadInput(f"{frame.name} has another orientation than {first.name}; {where} has slices of several stacks")
    heights = {}
    for frame in sorted(frames, key=lambda f: f.height()):
        at = next((h for h in list(heights)[-1:] if abs(frame.height() - h) <= 1e-3), frame.height())
        heights.setdefault(at, []).append(frame)
    count = len(next(iter(heights.values())))
    odd = next((group for group in heights.values() if len(group) != count), None)
    if odd:
        raise esvr.BadInput(f"{where} has {len(odd)} slices at the place of {odd[0].name}, and {count} at that of "
                            f"{next(iter(heights.values()))[0].name}")
    for group in heights.values():
        group.sort(key=lambda f: f.times)
        if len({f.times[:-1] for f in group}) != len(group) and len({f.number for f in group}) != len(group):
            raise esvr.BadInput(f"{group[0].name} and {group[1].name} are the same slice")
    volumes = [[group[k] for group in heights.values()] for k in range(count)]
    positions = np.array([[float(n) for n in group[0].position] for group in heights.values()])
    step = np.cross(along[:3], along[3:]) * float(first.header.get("SpacingBetweenSlices") or first.header.get("SliceThickness")
                                                  or 1)
    if len(positions) > 1:
        steps = np.diff(positions, axis=0)
        step = np.median(steps, axis=0)
        wrong = np.linalg.norm(steps - step, axis=1) > EVEN * np.linalg.norm(step)
        if wrong.any() and not options.voxel_size:
            at = int(np.argmax(wrong))
            pair = [volumes[0][at].name, volumes[0][at + 1].name]
            raise esvr.BadInput(f"{where}: the slices {pair[0]} and {pair[1]} are {np.linalg.norm(steps[at]):.4g} mm apart, and most "
                                f"others {np.linalg.norm(step):.4g} mm; a slice is missing, or the distances differ (--voxel-size "
                                "takes the slices as evenly spaced)")
        step = (positions[-1] - positions[0]) / (len(positions) - 1)
    matrix = np.eye(4)
    matrix[:3, 0], matrix[:3, 1], matrix[:3, 2] = along[:3] * rows[1], along[3:] * rows[0], step
    matrix[:3, 3] = positions[0]
    return volumes, matrix


# -- values ----------------------------------------------------------------------------------------------------------
class Frames:
    """A function for Image.fetch: slices, each read when it is needed."""

    def __init__(self, volumes, samples, options):
        self.volumes, self.samples, self.open_path, self.data = volumes, samples, None, None
        header = volumes[0][0].header
        scales = {frame.scale for frames in volumes for frame in frames}
        self.common_scale = scales.pop() if len(scales) == 1 else None
        self.own_scale = self.common_scale is None and not options.stored  # each slice has its slope
        self.bits, self.allocated = int(header.get("BitsStored") or 0), int(header.get("BitsAllocated") or 0)
        self.signed = bool(header.get("PixelRepresentation"))
        self.stored_dtype = np.dtype(f"{'i' if self.signed else 'u'}{max(self.allocated // 8, 1)}")
        if "PixelRepresentation" not in header and self.allocated in (32, 64):  # the header of float pixel data has none
            self.stored_dtype = np.dtype(f"f{self.allocated // 8}")
        self.dtype = np.dtype("f8") if self.own_scale else self.stored_dtype
        self.padding = self.padding_of(header)
        needed = product((header.Rows, header.Columns, samples)) * max(self.allocated, 1) // 8
        if needed * max(int(frame.header.get("NumberOfFrames") or 1) for frame in volumes[0]) * 2 > options.max_memory:
            raise esvr.MemoryExceeded(f"{volumes[0][0].path} is read as a whole, which asks for more than {options.max_memory} bytes "
                                      "of memory")
        for path in {frame.path for frames in volumes for frame in frames}:
            if not header.file_meta.get("TransferSyntaxUID") or not header.file_meta.TransferSyntaxUID.is_compressed:
                count = sum(frame.path == path for frames in volumes for frame in frames)
                require_bytes(path, needed * count, os.path.getsize(path), "the image")

    def padding_of(self, header):
        """The range of stored numbers that mean no voxel, outside of what the scanner sees."""
        low = header.get("PixelPaddingValue")
        if low is None or self.stored_dtype.kind not in "iu":
            return None
        high = header.get("PixelPaddingRangeLimit", low)
        limits = [int(np.int64(n).astype(self.stored_dtype)) for n in (low, high)]
        return min(limits), max(limits)

    def missing(self):
        if self.padding is None or self.own_scale:
            return None
        return lambda numbers: (numbers >= self.padding[0]) & (numbers <= self.padding[1])

    def __call__(self, index):
        frames = self.volumes
        if len(self.volumes) > 1:
            frames, index = self.volumes[index[0]], index[1:]
        else:
            frames = self.volumes[0]
        if isinstance(index[0], slice):
            return np.ma.stack([self.page(frame)[tuple(index[1:])] for frame in frames[index[0]]])
        return self.page(frames[index[0]])[tuple(index[1:])]

    def page(self, frame):
        if self.open_path != frame.path:
            import pydicom
            with reading(frame.path, "DICOM"):
                data = pydicom.dcmread(frame.path, force=True)
                if not hasattr(data.file_meta, "TransferSyntaxUID"):
                    data.file_meta.TransferSyntaxUID = pydicom.uid.ImplicitVRLittleEndian
                try:
                    pixels = data.pixel_array
                except RuntimeError as error:
                    if "require" in str(error) or "missing dependencies" in str(error):
                        raise esvr.Error(f"{frame.path}: the compression {data.file_meta.TransferSyntaxUID.name} needs a decoder; "
                                         "install the package python3-gdcm") from error
                    raise
            self.data, self.open_path = pixels.reshape((-1,) + pixels.shape[pixels.ndim - (3 if self.samples > 1 else 2):]), frame.path
        page = self.data[frame.number]
        if self.stored_dtype.kind in "iu" and 0 < self.bits < self.allocated and page.dtype.itemsize * 8 == self.allocated:
            unused = self.allocated - self.bits  # bits above may hold an overlay, or no sign
            page = (page << unused) >> unused
        page = page.astype(self.stored_dtype, copy=False)
        if not self.own_scale:
            return page
        values = page.astype(np.float64) * frame.scale[0] + frame.scale[1]
        if self.padding is not None:
            values = np.ma.MaskedArray(values, (page >= self.padding[0]) & (page <= self.padding[1]))
        return values
