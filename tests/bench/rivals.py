"""Compressors of arrays, at the PSNR or in the bytes of a file of ours, and smoke that is drawn alike."""
import json
import math

from bench import call


def sperr(program, raw, out, back, shape, rmse, spread):
    return ([program, "-c", raw, "--ftype", 32, "--dims", *shape[::-1], "--chunks", *shape[::-1], "--psnr",
             20 * math.log10(spread / rmse), "--bitstream", out], [program, "-d", out, "--decomp_f", back])


def sz3(program, raw, out, back, shape, rmse, spread):
    dims = ["-f", "-3", *shape[::-1]]
    return ([program, "-i", raw, "-z", out, *dims, "-M", "ABS", rmse], [program, "-z", out, "-o", back, *dims])


def zfp(program, raw, out, back, shape, rmse, spread):
    dims = ["-f", "-3", *shape[::-1], "-a", rmse]
    return [program, "-i", raw, "-z", out, *dims], [program, "-z", out, "-o", back, *dims]


WITH_ERROR = {"SPERR": sperr, "SZ3": sz3, "zfp": zfp}


def to_psnr(bench, name, volume, psnr, peak):
    """The row of a rival whose PSNR over the box is at least `psnr`, and at most 0.05 dB higher."""
    import esvr
    import numpy as np
    array = volume.to_numpy()
    raw, out, back = (bench.out / f"rival.{end}" for end in ("raw", "packed", "back"))
    array.tofile(raw)
    wanted = peak / 10 ** (psnr / 20)
    low, high = wanted / 16, wanted * 64
    for _ in range(24):
        middle = math.sqrt(low * high)
        pack, unpack = WITH_ERROR[name](bench.rival(name), raw, out, back, array.shape, middle, np.ptp(array))
        process = call(*pack)
        call(*unpack)
        made = np.fromfile(back, np.float32).reshape(array.shape)
        rmse = float(np.sqrt(np.mean((made.astype(np.float64) - array) ** 2)))
        excess = 20 * math.log10(wanted / rmse) if rmse > 0 else math.inf
        if 0 <= excess < 0.05:
            break
        low, high = (middle, high) if excess > 0 else (low, middle)
    made[array == volume.background] = volume.background  # of the voxels that are known to be empty
    made = esvr.Volume.from_numpy(made, background=volume.background, origin=list(volume.box[0]))
    figures = esvr.compare(volume, made, peak=peak)
    return {"row": name, "bytes": out.stat().st_size, "seconds": process.user_seconds, "psnr_box": psnr + excess,
            "psnr_active": figures.psnr_active, "psnr_t50": figures.psnr_t50}


def to_size(bench, name, volume, size):
    """The path of a volume that SPERR keeps in at most a size, and its bytes. The bits of a voxel are found by bisection."""
    import esvr
    import numpy as np
    array = volume.to_numpy()
    raw, packed, back = (bench.out / f"rival.{end}" for end in ("raw", "packed", "back"))
    array.tofile(raw)

    def pack(bits):
        call(bench.rival(name), "-c", raw, "--ftype", 32, "--dims", *array.shape[::-1], "--chunks", *array.shape[::-1], "--bpp",
             bits, "--bitstream", packed)
        return packed.stat().st_size
    low, high = 1e-5, 64.0 * size / array.size
    for _ in range(12):
        bits = math.sqrt(low * high)
        low, high = (bits, high) if pack(bits) <= size else (low, bits)
    taken = pack(low)
    call(bench.rival(name), "-d", packed, "--decomp_f", back)
    made, path = np.maximum(np.fromfile(back, np.float32).reshape(array.shape), 0), bench.out / "rival.vdb"
    esvr.Volume.from_numpy(made, origin=list(volume.box[0])).save(path, overwrite=True)
    return path, taken


def exact(bench, volume):
    raw, out = bench.out / "rival.raw", bench.out / "rival.packed"
    volume.to_numpy().tofile(raw)
    process = call("zstd", "-19", "-q", "-f", raw, "-o", out)
    return {"row": "zstd -19, exact", "bytes": out.stat().st_size, "seconds": process.user_seconds}


def write_smoke_preset(path, high, k, knots=64):
    """Writes a white transfer function up to a value: a voxel of value v has the opacity 1 - exp(-k v)."""
    values = [high * (i / knots) ** 2 for i in range(knots + 1)]
    points = [x for v in values for x in (v, -math.expm1(-k * v), 0.5, 0)]
    path.write_text(json.dumps([{"Name": "smoke", "ColorSpace": "RGB", "RGBPoints": [0.0, 1, 1, 1, high, 1, 1, 1],
                                 "Points": points}]))
    return path
