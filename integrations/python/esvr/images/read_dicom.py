"""Reader of DICOM: a series of slices in a file each, or of frames in one file."""
import functools
import os

import numpy as np

import esvr

from .image import LPS, LPS_TO_RAS, TIME, Axis, Image, affine_of, natural, need, planes, product, reading, require_bytes

EVEN = 0.01  # by this share of a slice, distances of slices may differ
SAME = ("Rows", "Columns", "SamplesPerPixel", "BitsAllocated", "PixelRepresentation", "PhotometricInterpretation")
TIMES = ("TemporalPositionIdentifier", "TemporalPositionIndex", "TriggerTime", "AcquisitionNumber", "EchoTime",
         "DiffusionBValue", "AcquisitionTime", "ContentTime", "InstanceNumber")


def is_dicom(path):
    with open(path, "rb") as file:
        head = file.read(132)
    # Files of old programs have no preamble and begin with one of the first elements of the group 8.
    begins = head[:2] == b"\x08\0" and head[3:4] == b"\0" and head[2:3] in b"\0\1\5\x08\x12\x14\x16\x18"
    return head[128:] == b"DICM" or begins and (head[4:6] in (b"CS", b"UI", b"UL") or 0 < int.from_bytes(head[4:8], "little") <= 64)


def read_dicom(paths, options, folder=None):
    """The series of some files. folder is what messages name, if the files are those of a folder."""
    pydicom = need("pydicom", "python3-pydicom", paths[0], "DICOM")
    series, where = {}, folder or paths[0]
    for path in paths:
        with reading(path, "DICOM"):
            header = pydicom.dcmread(path, stop_before_pixels=True, force=True)
            list(header)  # the elements are decoded when they are asked for
        if str(header.get("Modality")) == "SEG":
            raise esvr.BadInput(f"{path} is a DICOM segmentation, which is not read; save it as Seg.nrrd or NIfTI")
        if "Rows" in header:  # else a directory or a report
            series.setdefault(str(header.get("SeriesInstanceUID", "")), []).append((path, header))
    if not series:
        raise esvr.BadInput(f"{where} has no DICOM image")
    files = chosen_series(where, series, options)
    header = files[0][1]
    for path, other in files:
        for name in SAME:
            if other.get(name) != header.get(name):
                raise esvr.BadInput(f"{path} has {name} {other.get(name)}, and {files[0][0]} has {header.get(name)}; slices of one "
                                    "image have one size and type")
    return image_of(where, header, [frame for path, other in files for frame in frames_of(path, other)], options)


def chosen_series(where, series, options):
    """The files of the only series, or of the one that --dataset names by its number or UID."""
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


# -- frames ----------------------------------------------------------------------------------------------------------
class Frame:
    """A slice: its file, its place in it, and what the header says of it. own and shared are the functional groups of files
    of several frames."""

    def __init__(self, path, header, number, shared, own):
        def find(sequence, name):
            found = [group[sequence][0].get(name) for group in (own, shared) if group is not None and group.get(sequence)]
            return next((value for value in found if value is not None), header.get(name))
        self.path, self.header, self.number = path, header, number
        self.name = path if number == 0 and own is None else f"{path} (frame {number + 1})"
        self.spacing = find("PixelMeasuresSequence", "PixelSpacing") or header.get("ImagerPixelSpacing")
        slope = find("PixelValueTransformationSequence", "RescaleSlope")
        intercept = find("PixelValueTransformationSequence", "RescaleIntercept")
        if header.get("DoseGridScaling") is not None:
            slope, intercept = header.DoseGridScaling, 0
        self.scale = (float(1 if slope is None else slope), float(intercept or 0))
        self.times = tuple(as_number(find("FrameContentSequence", name)) for name in TIMES)
        self.along = find("PlaneOrientationSequence", "ImageOrientationPatient")
        self.position = find("PlanePositionSequence", "ImagePositionPatient")
        step, detector = 0.0, header.get("DetectorInformationSequence")
        if self.position is None and detector and "RECON TOMO" in header.get("ImageType", ()):  # of nuclear medicine
            self.along, self.position = detector[0].get("ImageOrientationPatient"), detector[0].get("ImagePositionPatient")
            step = float(header.get("SpacingBetweenSlices") or header.get("SliceThickness") or 1)
        self.is_placed = self.along is not None and self.position is not None
        if self.is_placed:
            self.along, self.position = np.array(self.along, float), np.array(self.position, float)
            self.normal = np.cross(self.along[:3], self.along[3:])
            self.position = self.position + self.normal * step * number
            offsets = header.get("GridFrameOffsetVector")
            if offsets is not None and len(offsets) > number:  # of doses, from the first frame, or from the origin
                self.position = self.position + self.normal * (float(offsets[number]) - (
                    float(offsets[0]) if offsets[0] == self.position[2] else 0.0))
            self.height = float(self.position @ self.normal)


def as_number(value):
    try:
        return float(value)
    except (TypeError, ValueError):
        return -1.0


def frames_of(path, header):
    count = int(header.get("NumberOfFrames") or 1)
    require_bytes(path, count, os.path.getsize(path), f"an image of {count} frames")
    shared, own = header.get("SharedFunctionalGroupsSequence"), header.get("PerFrameFunctionalGroupsSequence")
    if own is not None and len(own) != count:
        raise esvr.BadInput(f"{path} describes {len(own)} frames, and has {count}")
    return [Frame(path, header, k, shared[0] if shared else None, own[k] if own else None) for k in range(count)]


# -- geometry --------------------------------------------------------------------------------------------------------
def image_of(where, header, frames, options):
    samples, first, warnings = int(header.get("SamplesPerPixel", 1)), frames[0], []
    colors = header.get("PhotometricInterpretation", "")
    if samples > 1 and colors != "RGB" or colors == "PALETTE COLOR" and not options.stored:
        raise esvr.BadInput(f"{where} has colors as {colors}, which is not read; RGB is"
                            f"{', and --stored takes the numbers of the palette' if samples == 1 else ''}")
    if header.get("ModalityLUTSequence") and not options.stored:
        raise esvr.BadInput(f"{where} has values that a table calibrates, which is not read; --stored takes the stored numbers")
    without = next((frame for frame in frames if not frame.is_placed), None)
    if without and any(frame.is_placed for frame in frames):
        raise esvr.BadInput(f"{without.name} has no position, and other slices have")
    rows = [float(n) for n in first.spacing or (1, 1)]  # the distance of rows is the first number
    if first.spacing is None:
        warnings.append("the file has no pixel spacing, so that edges are 1")
    for frame in frames:
        if frame.spacing is not None and not np.allclose([float(n) for n in frame.spacing], rows):
            raise esvr.BadInput(f"{frame.name} has the pixel spacing {list(frame.spacing)}, and {first.name} has {rows}")
    if not without:
        volumes, affine = stacked(where, frames, rows, options)
    elif len({frame.path for frame in frames}) == 1:  # one slice, or a film
        volumes, affine = [[frame] for frame in frames], affine_of([rows[1], rows[0], 1.0])
    else:
        volumes = [sorted(frames, key=lambda f: (as_number(f.header.get("InstanceNumber")), natural(f.path), f.number))]
        affine = affine_of([rows[1], rows[0], float(header.get("SpacingBetweenSlices") or 1)])
        warnings.append("the slices have no positions; they are in the order of their instance numbers, and their distance is "
                        f"{affine[2, 2]:g}")
    axes = [Axis(TIME, len(volumes))] * (len(volumes) > 1) + [Axis("z", len(volumes[0])), Axis("y", int(header.Rows)),
                                                              Axis("x", int(header.Columns))]
    if samples > 1:
        axes.append(Axis("sample", samples))
    dtype, fetch, scale, missing = numbers_of(volumes, samples, options)
    metadata = {} if without else {"image_space": LPS}
    if header.get("RescaleType"):
        metadata["value_unit"] = str(header.RescaleType)
    return Image("DICOM", where, axes, dtype, fetch, LPS_TO_RAS @ affine, "mm" if first.spacing is not None else None, scale,
                 missing, warnings=warnings, metadata=metadata)


def stacked(where, frames, rows, options):
    """The volumes (one for each time) of sorted slices, and the matrix."""
    first, heights, last = frames[0], [], None
    for frame in frames:
        if not np.allclose(frame.along, first.along, atol=1e-3):
            raise esvr.BadInput(f"{frame.name} has another orientation than {first.name}; {where} has slices of several stacks")
    for frame in sorted(frames, key=lambda f: f.height):
        if last is None or frame.height - last > 1e-3:
            heights.append([])
            last = frame.height
        heights[-1].append(frame)
    count = len(heights[0])
    for group in heights:
        if len(group) != count:
            raise esvr.BadInput(f"{where} has {len(group)} slices at the place of {group[0].name}, and {count} at that of "
                                f"{heights[0][0].name}")
        group.sort(key=lambda f: f.times + (f.number,))
        if len({f.times for f in group}) != len(group) and len({f.number for f in group}) != len(group):
            raise esvr.BadInput(f"{group[0].name} and {group[1].name} are the same slice")
    positions = np.array([group[0].position for group in heights])
    step = first.normal * float(first.header.get("SpacingBetweenSlices") or first.header.get("SliceThickness") or 1)
    if len(positions) > 1:
        steps = np.diff(positions, axis=0)
        step = np.median(steps, axis=0)
        wrong = np.linalg.norm(steps - step, axis=1) > EVEN * np.linalg.norm(step)
        if wrong.any() and not options.voxel_size:
            at = int(np.argmax(wrong))
            raise esvr.BadInput(f"{where}: the slices {heights[at][0].name} and {heights[at + 1][0].name} are "
                                f"{np.linalg.norm(steps[at]):.4g} mm apart, and most others {np.linalg.norm(step):.4g} mm; a "
                                "slice is missing, or the distances differ (--voxel-size takes the slices as evenly spaced)")
        step = (positions[-1] - positions[0]) / (len(positions) - 1)
    matrix = np.eye(4)
    matrix[:3] = np.column_stack([first.along[:3] * rows[1], first.along[3:] * rows[0], step, positions[0]])
    return [[group[k] for group in heights] for k in range(count)], matrix


# -- values ----------------------------------------------------------------------------------------------------------
def numbers_of(volumes, samples, options):
    """The type, the function for Image.fetch, the scale and the function for Image.missing. Where each slice has a scale of
    its own, the numbers are calibrated values, and NaN where they are missing."""
    frames, header = [frame for volume in volumes for frame in volume], volumes[0][0].header
    bits, allocated = int(header.get("BitsStored") or 0), int(header.get("BitsAllocated") or 0)
    stored = np.dtype(f"{'i' if header.get('PixelRepresentation') else 'u'}{max(allocated // 8, 1)}")
    if "PixelRepresentation" not in header and allocated in (32, 64):  # the header of float pixel data has none
        stored = np.dtype(f"f{allocated // 8}")
    check_lengths(frames, product((header.Rows, header.Columns, samples)) * max(allocated, 1) // 8, options)
    padding = None  # the range of stored numbers that mean no voxel, outside of what the scanner sees
    if header.get("PixelPaddingValue") is not None and stored.kind in "iu":
        limits = header.PixelPaddingValue, header.get("PixelPaddingRangeLimit", header.PixelPaddingValue)
        padding = sorted(int(np.int64(n).astype(stored)) for n in limits)
    pixels = functools.lru_cache(1)(lambda path: pixels_of(path, 3 if samples > 1 else 2))
    is_own = len({frame.scale for frame in frames}) > 1 and not options.stored

    def missing(numbers):
        return (numbers >= padding[0]) & (numbers <= padding[1])

    def read(number, index):
        frame = frames[number]
        page = pixels(frame.path)[frame.number][index]
        if stored.kind in "iu" and 0 < bits < allocated and page.dtype.itemsize * 8 == allocated:
            page = (page << allocated - bits) >> allocated - bits  # bits above may hold an overlay, or no sign
        page = page.astype(stored, copy=False)
        if not is_own:
            return page
        values = page * np.float64(frame.scale[0]) + frame.scale[1]
        return np.where(missing(page), np.nan, values) if padding else values
    leading = [len(volumes)] * (len(volumes) > 1) + [len(volumes[0])]
    return (np.dtype("f8") if is_own else stored, planes(leading, read), None if is_own else frames[0].scale,
            (np.isnan if is_own else missing) if padding else None)


def check_lengths(frames, needed, options):
    """Checks the sizes of the files and of the memory, which takes the frames of one file as a whole."""
    files = {}
    for frame in frames:
        files.setdefault(frame.path, []).append(frame)
    for path, here in files.items():
        if needed * len(here) * 2 > options.max_memory:
            raise esvr.MemoryExceeded(f"{path} is read as a whole, which asks for more than {options.max_memory} bytes of memory")
        syntax = here[0].header.file_meta.get("TransferSyntaxUID")
        if not syntax or not syntax.is_compressed:
            require_bytes(path, needed * len(here), os.path.getsize(path), "the image")


def pixels_of(path, page_axes):
    import pydicom
    with reading(path, "DICOM"):
        data = pydicom.dcmread(path, force=True)
        if not hasattr(data.file_meta, "TransferSyntaxUID"):
            data.file_meta.TransferSyntaxUID = pydicom.uid.ImplicitVRLittleEndian
        try:
            pixels = data.pixel_array
        except RuntimeError as error:
            if "require" in str(error) or "missing dependencies" in str(error):
                raise esvr.Error(f"{path}: the compression {data.file_meta.TransferSyntaxUID.name} needs a decoder; install the "
                                 "package python3-gdcm") from error
            raise
        return pixels.reshape((-1,) + pixels.shape[pixels.ndim - page_axes:])
