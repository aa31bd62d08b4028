"""The files that the examples of --help read, by name."""
import shutil
import struct
import subprocess
import sys

FRAMES = 3
PLUME = "24"  # voxels along the longest side of a sample
IMAGE_SIDE = 64  # the number that an example of esvr-compare table names

# A compressor of float arrays for esvr-compare: multiples of the bound, deflated.
COMPRESSOR = """#!/usr/bin/env python3
import array, sys, zlib
job, source, target = sys.argv[1:4]
bound = float(sys.argv[-1])
data = open(source, "rb").read()
if job == "encode":
    steps = array.array("q", (round(x / bound) for x in array.array("f", data)))
    open(target, "wb").write(zlib.compress(steps.tobytes()))
else:
    steps = array.array("q", zlib.decompress(data))
    open(target, "wb").write(array.array("f", (s * bound for s in steps)).tobytes())
"""
PRESETS = """[{"Name": "Smoke", "ColorSpace": "RGB", "RGBPoints": [0, 0, 0, 0, 1, 1, 1, 1],
"Points": [0, 0, 0.5, 0, 1, 1, 0.5, 0]}]"""
SKELETON = "1 1 0 0 0 5 -1\n2 3 40 0 0 2 1\n3 3 60 30 10 1 2\n"


def program(*words):
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"no input: {words}: {done.stdout}{done.stderr}")


def ball():
    """A soft ball of values up to 400 as float32."""
    middle = (IMAGE_SIDE - 1) / 2
    squares = [(i - middle) ** 2 for i in range(IMAGE_SIDE)]
    values = (max(0.0, 40 * (IMAGE_SIDE / 3 - (x + y + z) ** 0.5))
              for z in squares for y in squares for x in squares)
    return struct.pack(f"<{IMAGE_SIDE ** 3}f", *(min(400.0, value) for value in values))


class Inputs:
    """Makes each file once in a folder of its own, and copies it to the examples."""

    def __init__(self, folder, make_grids):
        self.folder, self.make_grids = folder, make_grids
        folder.mkdir()

    def provide(self, name, folder, is_sequence):
        """Copies the file to the folder if it is one that this class makes."""
        kind = "frames " if is_sequence and name == "smoke.esvr" else ""
        make = self.maker(kind + name)
        if not make:
            return
        made = self.folder / (kind + name).replace("/", "+").replace(" ", "-")
        if not made.exists():
            made.mkdir()
            make(made / name)
        shutil.copytree(made, folder, dirs_exist_ok=True)

    def maker(self, name):
        if name in TEXTS:
            return lambda path: self.text(path, TEXTS[name])
        if name in GRIDS:
            return lambda path: self.grids(path, GRIDS[name])
        if name in FITTED:
            return lambda path: self.fit(path, FITTED[name])
        return {"smoke.####.vdb": self.frames, "ct.vdb": self.image, "out.raw": lambda path: path.write_bytes(ball()),
                "back.vdb": self.back, "splats.ply": self.splats}.get(name)

    def text(self, path, text):
        path.parent.mkdir(exist_ok=True)
        path.write_text(text)
        path.chmod(0o755)

    def grids(self, path, names):
        source = self.folder / "of-plume.vdb"
        program("esvr-sample", "plume", source, "--resolution", PLUME, "--force")
        program(self.make_grids, source, path, *names)

    def frames(self, path):
        program("esvr-sample", "plume", path, "--resolution", PLUME, "--frames", FRAMES)

    def image(self, path):
        raw = path.with_suffix(".raw")
        raw.write_bytes(ball())
        program(self.make_grids, raw, path, IMAGE_SIDE)
        raw.unlink()

    def fit(self, path, source):
        """Ellipsoids with the quality that examples of limits ask for. An image takes long to fit."""
        if source == "ct.vdb":
            self.convert(path, source, "--max-error", "1%")
        else:
            self.convert(path, source, "--psnr", "50", "--topology", "exact", "--representation",
                         "ellipsoids")

    def convert(self, path, source, *options):
        folder = self.folder / ("for-" + path.name)
        folder.mkdir(exist_ok=True)
        self.maker(source)(folder / source)
        program("vdb2esvr", folder / source, path, *options)

    def splats(self, path):
        fitted = self.folder / "of-splats.esvr"
        self.convert(fitted, "smoke.vdb", "--psnr", "40", "--representation", "ellipsoids", "--force")
        program("esvr2vdb", fitted, path)

    def back(self, path):
        near = self.folder / "of-near.esvr"
        self.convert(near, "smoke.vdb", "--max-error", "0.5%")
        program("esvr2vdb", near, path)


TEXTS = {"presets.json": PRESETS, "neuron.swc": SKELETON, "compressors/sz3": COMPRESSOR}
GRIDS = {"smoke.vdb": ["density"], "ref.vdb": ["density"], "new.vdb": ["smoke"], "big.vdb": ["density"],
         "frame.vdb": ["density", "velocity"], "fire.vdb": ["density", "temperature"], "ocean.vdb": ["salt_with_gaps"]}
FITTED = {"smoke.esvr": "smoke.vdb", "frames smoke.esvr": "smoke.####.vdb",
          "smoke.####.esvr": "smoke.####.vdb", "ct.esvr": "ct.vdb", "fire.esvr": "fire.vdb",
          "20k.esvr": "smoke.vdb", "40k.esvr": "smoke.vdb", "80k.esvr": "smoke.vdb"}
