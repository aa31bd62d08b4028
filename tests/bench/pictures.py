#!/usr/bin/env python3
"""Pictures that a person can judge: smoke at the same bytes, with and without a tone curve, and by SPERR.

    pictures.py --bin FOLDER --data FOLDER --out FOLDER --sperr PROGRAM

Each row of OUT/seen_NAME.png is a density: the source, ESVR, ESVR with --tone off and SPERR, all in the bytes of a
hundredth of the half-float Blosc VDB, or of a 25th where that is small. The opacity is such that the median column of voxels lets 0.5 or 0.1 of the light
through. FOLDER of --bin is a build folder with the Python module; python3-matplotlib and python3-numpy are needed.
"""
import argparse
import json
import math
import pathlib
import subprocess
import sys

# The grid, and the part of the bytes of the source that a picture may take.
VOLUMES = {"smoke1": (None, 100), "plume_256": (None, 100), "gas_0006": ("density", 25), "fluid_data_0071": ("density", 25)}
LIGHT = (0.5, 0.1)
SIDE = 380  # pixels


def run(*words):
    subprocess.run([str(word) for word in words], check=True, stdout=subprocess.DEVNULL)


class Bench:
    def __init__(self, arguments):
        self.bin, self.data, self.out = (p.resolve() for p in (arguments.bin, arguments.data, arguments.out))
        self.sperr = arguments.sperr
        sys.path.insert(0, str(self.bin / "python"))
        self.out.mkdir(parents=True, exist_ok=True)

    def source(self, name):
        if name == "plume_256":
            path = self.out / "plume_256.vdb"
            if not path.exists():
                run(self.bin / "samples/esvr-sample", "plume", path, "--resolution", 256)
            return path
        return next(self.data.rglob(f"{name}.vdb"))

    def by_sperr(self, volume, size):
        """A volume that SPERR keeps in at most a size: the bits of a voxel are found by bisection."""
        import numpy as np
        import esvr
        array = volume.to_numpy()
        raw, packed, back = (self.out / f"seen.{end}" for end in ("raw", "packed", "back"))
        array.tofile(raw)
        low, high = 1e-5, 64.0 * size / array.size
        for _ in range(12):
            bits = math.sqrt(low * high)
            run(self.sperr, "-c", raw, "--ftype", 32, "--dims", *array.shape[::-1], "--chunks", *array.shape[::-1],
                "--bpp", bits, "--bitstream", packed)
            low, high = (bits, high) if packed.stat().st_size <= size else (low, bits)
        run(self.sperr, "-c", raw, "--ftype", 32, "--dims", *array.shape[::-1], "--chunks", *array.shape[::-1],
            "--bpp", low, "--bitstream", packed)
        run(self.sperr, "-d", packed, "--decomp_f", back)
        made = np.maximum(np.fromfile(back, np.float32).reshape(array.shape), 0)
        path = self.out / "seen_sperr.vdb"
        esvr.Volume.from_numpy(made, origin=list(volume.box[0])).save(path, overwrite=True)
        return path, packed.stat().st_size

    def columns(self, name, grid, part):
        """The source and what is compared with it: titles, files, bytes and volumes."""
        import esvr
        source = self.source(name)
        volume = esvr.Volume.from_vdb(source, *([grid] if grid else []))
        blosc = self.out / "seen.vdb"
        volume.save(blosc, overwrite=True)
        size = blosc.stat().st_size // part
        columns = [("source", source, blosc.stat().st_size, volume)]
        for title, options in {"ESVR": [], "ESVR, --tone off": ["--tone", "off"]}.items():
            file = self.out / f"seen_{len(columns)}.esvr"
            run(self.bin / "vdb2esvr/vdb2esvr", source, file, *(["--grid", grid] if grid else []), "--size", size, *options,
                "--device", "cpu", "--quiet", "--force")
            columns.append((title, file, file.stat().st_size, esvr.read(file)[grid or "density"].to_volume()))
        path, taken = self.by_sperr(volume, size)
        columns.append(("SPERR", path, taken, esvr.Volume.from_vdb(path)))
        return volume, columns

    def sheet(self, name, grid, part):
        import esvr
        from matplotlib import pyplot
        volume, columns = self.columns(name, grid, part)
        depth = esvr.compare(volume, volume).median_depth
        high = volume.value_range[1]
        figure, axes = pyplot.subplots(len(LIGHT), len(columns), figsize=(3.3 * len(columns), 3.5 * len(LIGHT)))
        for row, light in enumerate(LIGHT):
            # The opacity of the largest value over a voxel is 1 - exp(-k high).
            k = -math.log(light) / depth
            values = [high * (i / 64) ** 2 for i in range(65)]
            preset = self.out / "seen.json"
            preset.write_text(json.dumps([{
                "Name": "seen", "RGBPoints": [0.0, 1, 1, 1, high, 1, 1, 1],
                "Points": [x for v in values for x in (v, 1 - math.exp(-k * v), 0.5, 0)]}]))
            for column, (title, path, taken, made) in enumerate(columns):
                picture = self.out / "seen.png"
                own = ["--grid", grid] if grid and path.suffix == ".vdb" and title == "source" else []
                run(self.bin / "render/esvr-render", path, picture, *own, "--resolution", f"{SIDE}x{SIDE}", "--tf", preset,
                    "--range", "own", "--background", "0.05,0.07,0.1", "--device", "cpu", "--force")
                axes[row][column].imshow(pyplot.imread(picture))
                axes[row][column].axis("off")
                if row == 0:
                    figures = esvr.compare(volume, made)
                    lost = "" if title == "source" else f"\nT 0.5 {figures.psnr_t50:.1f} dB, active {figures.psnr_active:.1f} dB"
                    axes[row][column].set_title(f"{title}: {taken:,} bytes{lost}", fontsize=9)
        figure.tight_layout()
        figure.savefig(self.out / f"seen_{name}.png", dpi=110)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bin", type=pathlib.Path, required=True)
    parser.add_argument("--data", type=pathlib.Path, required=True)
    parser.add_argument("--out", type=pathlib.Path, required=True)
    parser.add_argument("--sperr", required=True, metavar="PROGRAM", help="sperr3d")
    parser.add_argument("--volumes", nargs="+", default=list(VOLUMES))
    arguments = parser.parse_args()
    bench = Bench(arguments)
    for name in arguments.volumes:
        bench.sheet(name, *VOLUMES[name])
    return 0


if __name__ == "__main__":
    sys.exit(main())
