#!/usr/bin/env python3
"""Error against run time: the encoder at several efforts beside compressors of arrays (docs/figures/speed.md).

    speed.py measure --bin FOLDER --data FOLDER --out FOLDER [--volumes NAME...] [--rival NAME=PROGRAM...]
    speed.py page --out FOLDER

`measure` writes OUT/speed.json, a list of rows for each volume; volumes that it has are not measured again. ESVR runs
with its defaults at three efforts, with two threads. The rivals compress the box of the active voxels as a dense array
and reach the PSNR over this box that the default of ESVR has; the setting is found by bisection, which is not timed.
NAME is SPERR, SZ3 or zfp, and PROGRAM their sperr3d, sz3 or zfp. zstd -19 stores the array exactly. Seconds are user
CPU seconds of whole processes. FOLDER of --bin is a build folder with the Python module.
"""
import argparse
import json
import math
import pathlib
import resource
import statistics
import subprocess
import sys

VOLUMES = ["smoke1", "plume_256", "gas_0004", "hydrogen_atom", "aneurism", "wdas_cloud_sixteenth",
           "dragon_with_xform", "neuron_rp140212", "cube_levelset"]
EFFORTS = (1, 5, 9)
GRIDS = {"gas_0004": "density"}


def timed(*words):
    """User CPU seconds of a process."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    subprocess.run([str(word) for word in words], check=True, stdout=subprocess.DEVNULL)
    return resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before


def sperr(program, raw, out, back, shape, rmse, spread):
    return ([program, "-c", raw, "--ftype", 32, "--dims", *shape[::-1], "--chunks", *shape[::-1], "--psnr",
             20 * math.log10(spread / rmse), "--bitstream", out], [program, "-d", out, "--decomp_f", back])


def sz3(program, raw, out, back, shape, rmse, spread):
    dims = ["-f", "-3", *shape[::-1]]
    return ([program, "-i", raw, "-z", out, *dims, "-M", "ABS", rmse], [program, "-z", out, "-o", back, *dims])


def zfp(program, raw, out, back, shape, rmse, spread):
    dims = ["-f", "-3", *shape[::-1], "-a", rmse]
    return [program, "-i", raw, "-z", out, *dims], [program, "-z", out, "-o", back, *dims]


RIVALS = {"SPERR": sperr, "SZ3": sz3, "zfp": zfp}


class Bench:
    def __init__(self, arguments):
        self.bin, self.out, self.data = (p.resolve() for p in (arguments.bin, arguments.out, arguments.data))
        sys.path.insert(0, str(self.bin / "python"))
        self.rivals = dict(rival.split("=", 1) for rival in arguments.rival)
        self.out.mkdir(parents=True, exist_ok=True)

    def source(self, name):
        if name == "plume_256":
            path = self.out / "plume_256.vdb"
            if not path.exists():
                timed(self.bin / "samples/esvr-sample", "plume", path, "--resolution", 256)
            return path
        return next(self.data.rglob(f"{name}.vdb"))

    def ours(self, name, effort):
        report, file = self.out / "speed_report.json", self.out / "speed.esvr"
        grid = ["--grid", GRIDS[name]] if name in GRIDS else []
        seconds = timed(self.bin / "vdb2esvr/vdb2esvr", self.source(name), file, *grid, "--effort", effort, "--threads",
                        2, "--device", "cpu", "--quiet", "--force", "--report", report)
        metrics = json.loads(report.read_text())["grids"][0]["metrics"]
        quality = json.loads(report.read_text())["grids"][0]["quality"]
        return {"row": f"ESVR, effort {effort}", "bytes": file.stat().st_size, "seconds": seconds,
                "psnr_box": metrics["psnr_box"], "psnr_active": metrics["psnr_active"],
                "psnr_t50": quality["psnr_t50"] if quality else None, "peak": metrics["peak"]}

    def rival(self, name, volume, psnr, peak):
        """The row of a rival whose PSNR over the box is at least that of ours, and at most 0.05 dB higher."""
        import numpy as np
        import esvr
        array = volume.to_numpy()
        raw, out, back = (self.out / f"speed.{end}" for end in ("raw", "packed", "back"))
        array.tofile(raw)
        wanted = peak / 10 ** (psnr / 20)
        low, high = wanted / 16, wanted * 64
        for _ in range(24):
            middle = math.sqrt(low * high)
            pack, unpack = RIVALS[name](self.rivals[name], raw, out, back, array.shape, middle, np.ptp(array))
            seconds = timed(*pack)
            timed(*unpack)
            made = np.fromfile(back, np.float32).reshape(array.shape)
            rmse = float(np.sqrt(np.mean((made.astype(np.float64) - array) ** 2)))
            excess = 20 * math.log10(wanted / rmse) if rmse > 0 else math.inf
            if 0 <= excess < 0.05:
                break
            low, high = (middle, high) if excess > 0 else (low, middle)
        made[array == volume.background] = volume.background  # of the voxels that are known to be empty
        back = esvr.Volume.from_numpy(made, background=volume.background, origin=list(volume.box[0]))
        figures = esvr.compare(volume, back, peak=peak)
        return {"row": name, "bytes": out.stat().st_size, "seconds": seconds, "psnr_box": psnr + excess,
                "psnr_active": figures.psnr_active, "psnr_t50": figures.psnr_t50}

    def exact(self, volume):
        raw, out = self.out / "speed.raw", self.out / "speed.packed"
        volume.to_numpy().tofile(raw)
        seconds = timed("zstd", "-19", "-q", "-f", raw, "-o", out)
        return {"row": "zstd -19, exact", "bytes": out.stat().st_size, "seconds": seconds}

    def measure(self, name):
        rows = [self.ours(name, effort) for effort in EFFORTS]
        import esvr
        volume = esvr.Volume.from_vdb(self.source(name), *([GRIDS[name]] if name in GRIDS else []))
        default = rows[1]
        if default["psnr_box"] is not None:  # otherwise it is exact
            rows += [self.rival(rival, volume, default["psnr_box"], default["peak"]) for rival in self.rivals]
        return rows + [self.exact(volume)]


def measure(arguments):
    bench, path = Bench(arguments), arguments.out / "speed.json"
    done = json.loads(path.read_text()) if path.exists() else {}
    for name in arguments.volumes:
        if name not in done:
            done[name] = bench.measure(name)
            path.write_text(json.dumps(done, indent=1) + "\n")
            print(name, file=sys.stderr, flush=True)


def shown(value, digits=2):
    return "-" if value is None else f"{value:,.{digits}f}"


def page(arguments):
    volumes = json.loads((arguments.out / "speed.json").read_text())
    print("| volume | row | bytes | user CPU s | PSNR box | PSNR active | T 0.5 |\n|---|---|--:|--:|--:|--:|--:|")
    for name, rows in volumes.items():
        for row in rows:
            print(f"| {name} | {row['row']} | {row['bytes']:,} | {shown(row['seconds'])} | {shown(row.get('psnr_box'))} | "
                  f"{shown(row.get('psnr_active'))} | {shown(row.get('psnr_t50'))} |")
    for rival in RIVALS:
        pairs = [(row, next((r for r in rows if r["row"] == rival), None))
                 for rows in volumes.values() for row in rows if row["row"].startswith("ESVR")]
        for effort in EFFORTS:
            both = [(a, b) for a, b in pairs if b and a["row"] == f"ESVR, effort {effort}"]
            if both:
                times = statistics.median(a["seconds"] / max(b["seconds"], 0.01) for a, b in both)
                sizes = statistics.median(b["bytes"] / a["bytes"] for a, b in both)
                print(f"\nAgainst {rival}, effort {effort}, median of {len(both)} volumes: {times:.0f} times the seconds, "
                      f"and {rival} takes {sizes:.1f} times the bytes.")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    job = commands.add_parser("measure")
    job.add_argument("--bin", type=pathlib.Path, required=True)
    job.add_argument("--data", type=pathlib.Path, required=True)
    job.add_argument("--out", type=pathlib.Path, required=True)
    job.add_argument("--volumes", nargs="+", default=VOLUMES)
    job.add_argument("--rival", action="append", default=[], metavar="NAME=PROGRAM")
    job = commands.add_parser("page")
    job.add_argument("--out", type=pathlib.Path, required=True)
    arguments = parser.parse_args()
    return measure(arguments) if arguments.command == "measure" else page(arguments)


if __name__ == "__main__":
    sys.exit(main())
