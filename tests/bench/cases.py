"""The cases that measure rows for tables of the documents beyond the record. Each of them yields its points: a key, and a
function that measures the rows of the point.
"""
import csv
import math
import statistics
from functools import partial

import rivals
from bench import ROOT, SAMPLES, call

VOLUMES = ["aneurism", "smoke1", "wdas_cloud_sixteenth", "hydrogen_atom", "dragon_with_xform", "cube_levelset",
           "neuron_rp140212", "neuron_m207"]
PARTS = (200, 50, 25, 10, 4)  # of the bytes of the half-float Blosc VDB
SMALLEST = 600                # bytes; smaller files hold little but headers
COUNTS = {"aneurism": 12000, "smoke1": 12000, "wdas_cloud_sixteenth": 12000, "neuron_rp140212": 20000,
          "neuron_m207": 30000, "hydrogen_atom": 4000}
DRAWN = {"default": [], "post": ["--classification", "post"], "shade": ["--shade"], "sum": ["--between", "sum"],
         "sum, 1 part": ["--between", "sum", "--depth-parts", "1"],
         "sum, 16 parts": ["--between", "sum", "--depth-parts", "16"],
         "0.03 GB": ["--max-vram", "0.03"], "0.02 GB": ["--max-vram", "0.02"]}
RESOLUTIONS = (256, 512, 1024, 2048)
PAPER_COUNTS = {"aneurism": 93_000, "8area": 97_000, "empty-sphere": 155_000, "synth-tube": 61_000,
                "synth-wiggle": 33_000, "diffuse-scalar": 105_000}  # ellipsoids before pruning in the paper's tables
PAPER_RUNS = {"ellipsoid": {}, "gaussian": {"kernel": "gaussian"}, "score no-fa": {"prune-score": "no-fa"},
              "score only-fa": {"prune-score": "only-fa"}, "k 3": {"k": "3"}, "k learned": {"k": "learned"}}
EFFORTS = (1, 5, 9)
SPEED = ["smoke1", "plume_256", "gas_0004", "hydrogen_atom", "aneurism", "wdas_cloud_sixteenth", "dragon_with_xform",
         "neuron_rp140212", "cube_levelset"]
DENSITY_ALONE = ("gas_0004", "gas_0006", "fluid_data_0071")  # of their grids
SEEN = {"smoke1": 100, "plume_256": 100, "gas_0006": 25, "fluid_data_0071": 25}  # parts of the bytes of the source
SEEN_LIGHT = (0.5, 0.1)  # that the median column of voxels lets through
SEEN_SIDE = 380          # pixels
SEARCHED = {"preset": ["--measure", "values"], "psnr 40": ["--psnr", "40"], "psnr 50": ["--psnr", "50"],
            "ratio 50": ["--ratio", "50", "--measure", "values"]}  # goals that are PSNR values or bytes
BYTES_EACH, DB_PER_DOUBLING, GAIN_OF_WHOLE = 7.5, 4.5, 1.6  # of an ellipsoid; of twice as many; of a whole fit, dB
COARSER = {"lossless": ["--lossless"], "1 %": ["--max-error", "1%"],
           "ellipsoids": ["--psnr", "40", "--representation", "ellipsoids"]}


def grid_of(name):
    return ["--grid", "density"] if name in DENSITY_ALONE else []


def read_volume(bench, name):
    import esvr
    return esvr.Volume.from_vdb(bench.volume(name), *grid_of(name)[1:])


def commands(bench):
    """The rivals as esvr-compare takes them."""
    return [word for rival in bench.arguments.rival for word in ("--external-command", rival)]


def formats(bench):
    """Other formats at the same bytes: half-float Blosc VDB divided by 200 to 4 (docs/figures/comparison.md)."""
    def rows(name, part, size, source):
        point = {"volume": name, "part": f"1/{part}", "size": size}
        for title, measure in {"ESVR": "auto", "ESVR, --measure values": "values"}.items():
            file, row = bench.fit(name, "--size", size, "--measure", measure, allowed=(0, 2, 3, 4))
            yield {**point, "row": title, **row}
        words = [source[0], *([file] if file else []), *source[1:], *([] if file else ["--size", size])]
        report, _ = bench.report("esvr-compare", "table", *words, "--rows", "matched,zfp", "--max-dense", "1GB", "--runs", 1,
                                 *commands(bench))
        keys = ("bytes", "psnr_box", "psnr_active", "psnr_t50", "max_error", "iou", "encode_s", "decode_s")
        for row in report["rows"]:
            if (row.get("bytes") or math.inf) <= 1.02 * size and row["group"] != "ESVR":
                yield {**point, "row": row["name"], **{key: row[key] for key in keys if key in row}}

    for name in bench.chosen([*VOLUMES, "plume_112", "tree_208", "blobs_88"]):
        source = [bench.volume(name), *bench.box(name)]
        whole = bench.report("esvr-compare", "table", *source, "--rows", "none", "--runs", 1)[0]["half_blosc_bytes"]
        for part in PARTS:
            if whole // part >= SMALLEST:
                yield (name, f"1/{part}"), partial(rows, name, part, whole // part, source)


def counts(bench):
    """Single fits with the numbers of ellipsoids of docs/figures/benchmarks.md, quantised and as float32."""
    def rows(name, storage):
        yield {"volume": name, "storage": storage,
               **bench.fit(name, "--count", COUNTS[name], "--storage", storage, "--representation", "ellipsoids")[1]}
    for name in bench.chosen(COUNTS):
        for storage in ("compact", "float32"):
            yield (name, storage), partial(rows, name, storage)


def drawing(bench):
    """Pictures a second against NanoVDB, with ways to draw (docs/figures/benchmarks.md)."""
    def rows(name, way):
        file, _ = bench.fit(name, "--count", COUNTS[name], "--storage", "float32", "--representation", "ellipsoids")
        report, _ = bench.report("esvr-render", file, "--bench", "--ref", bench.volume(name), "--turntable",
                                 bench.arguments.views, "--device", bench.device, *DRAWN[way])
        drawn, nano, image = report["drawn"], report["reference"], report["image"]
        yield {"volume": name, "way": way, "nanovdb_fps": nano["fps_median"], "fps": drawn["fps_median"],
               "cold_fps": drawn["cold_fps_median"], "low_fps": drawn["fps_1_percent_low"],
               "mb": drawn["device_bytes"] / 1e6, "nanovdb_mb": nano["device_bytes"] / 1e6,
               "psnr": image["psnr"]["mean"], "ssim": image["ssim"]["mean"]}
    for name in bench.chosen(COUNTS):
        for way in DRAWN:
            yield (name, way), partial(rows, name, way)


def paper(bench):
    """The paper's method and its ablations, and the default fit with as many ellipsoids (docs/figures/paper.md)."""
    def rows(name, key):
        words = {"epochs": bench.arguments.epochs, "points": min(100_000, PAPER_COUNTS[name]), "max": PAPER_COUNTS[name],
                 **PAPER_RUNS[key]}
        _, row = bench.fit(name, "--paper", ",".join(f"{k}={v}" for k, v in words.items()))
        yield {"volume": name, "run": key, **row}
        if key == "ellipsoid":
            ours = bench.fit(name, "--count", row["ellipsoids"], "--representation", "ellipsoids")[1]
            yield {"volume": name, "run": "default fit", **ours}
    for name in bench.chosen(PAPER_COUNTS):
        for key in PAPER_RUNS:
            yield (name, key), partial(rows, name, key)


def resolution(bench):
    """Bytes of skeletons at rising resolutions, ESVR and other forms (docs/figures/resolution.md)."""
    def rows(name, swc, side):
        path = bench.out / f"{name}.vdb"
        if not path.exists():
            bench.run("swc2vdb", swc, path, "--resolution", side)
        SAMPLES[name] = []  # the volume is in OUT
        _, row = bench.fit(name, "--preset", "draft")
        report, _ = bench.report("esvr-compare", "table", path, "--psnr-active", row["psnr_active"], "--rows", "matched,zfp",
                                 "--max-dense", "1GB", "--runs", 1, *commands(bench))
        point = {"skeleton": swc.stem, "resolution": side}
        yield {**point, "row": "ESVR", **row}
        for row in report["rows"]:
            if row.get("bytes"):
                yield {**point, "row": row["name"], "bytes": row["bytes"], "psnr_active": row["psnr_active"]}
    for swc in sorted(bench.data.rglob("*.swc")):
        for side in RESOLUTIONS:
            for name in bench.chosen([f"{swc.stem}-{side}"]):
                yield (name,), partial(rows, name, swc, side)


def chunks(bench):
    """Fits in chunks against one fit of the whole volume, whose count grows with the volume (docs/figures/scale.md)."""
    def rows(name, side, voxels):
        options = ["--chunk-voxels", voxels] if voxels else []
        yield {"volume": name, "chunk_voxels": voxels,
               **bench.fit(name, "--count", 40 * side, "--representation", "ellipsoids", *options)[1]}
    for side in (256, 512, 1024):
        name = f"tree_{side}"
        SAMPLES[name] = ["tree", "--resolution", side]
        for voxels in (None, 50_000, 200_000):
            yield (str(side), str(voxels)), partial(rows, name, side, voxels)


def speed(bench):
    """Error against user CPU seconds: three efforts with two threads beside compressors of arrays (docs/figures/speed.md).

    The rivals compress the box of the active voxels as a dense array and reach the PSNR over this box that the default of
    ESVR has; the search for their setting is not timed. zstd -19 stores the array exactly.
    """
    def ours(name, effort):
        file = bench.out / "speed.esvr"
        report, process = bench.report("vdb2esvr", bench.volume(name), file, *grid_of(name), "--effort", effort, "--threads", 2,
                                       "--device", "cpu")
        grid = report["grids"][0]
        return {"row": f"ESVR, effort {effort}", "bytes": file.stat().st_size, "seconds": process.user_seconds,
                "psnr_box": grid["metrics"]["psnr_box"], "psnr_active": grid["metrics"]["psnr_active"],
                "psnr_t50": (grid["quality"] or {}).get("psnr_t50"), "peak": grid["metrics"]["peak"]}

    def rows(name):
        made = [ours(name, effort) for effort in EFFORTS]
        volume = read_volume(bench, name)
        default = made[EFFORTS.index(5)]
        if default["psnr_box"] is not None:  # otherwise it is exact
            made += [rivals.to_psnr(bench, rival, volume, default["psnr_box"], default["peak"]) for rival in bench.rivals]
        made.append(rivals.exact(bench, volume))
        return [{"volume": name, **row} for row in made]

    for name in bench.chosen(SPEED):
        yield (name,), partial(rows, name)


def speed_summary(rows):
    """The medians over the volumes: seconds of ESVR relative to those of a rival, and its bytes relative to those of ESVR."""
    by_volume = {}
    for row in rows:
        by_volume.setdefault(row["volume"], {})[row["row"]] = row
    for rival in rivals.WITH_ERROR:
        for effort in EFFORTS:
            pairs = [(made[f"ESVR, effort {effort}"], made[rival]) for made in by_volume.values() if rival in made]
            if pairs:
                yield {"against": rival, "effort": effort, "volumes": len(pairs),
                       "times the seconds": statistics.median(a["seconds"] / max(b["seconds"], 0.01) for a, b in pairs),
                       "times their bytes": statistics.median(b["bytes"] / a["bytes"] for a, b in pairs)}


def sizes(bench):
    """The least and the usual effort in the bytes of SPERR: PSNR over the active voxels, and user CPU seconds
    (docs/figures/speed.md). The figures of SPERR are those of docs/figures/external_points.csv.
    """
    names = {"wdas": "wdas_cloud_sixteenth", "dragon": "dragon_with_xform"}

    def row(point, name):
        made = {"volume": name, "bytes": int(point["bytes"]), "SPERR": float(point["psnr_nonzero_db"])}
        for effort in EFFORTS[:2]:
            report, process = bench.report("vdb2esvr", bench.volume(name), bench.out / "sizes.esvr", *bench.box(name), "--size",
                                           point["bytes"], "--measure", "values", "--effort", effort, "--threads", 2,
                                           "--device", "cpu")
            grid = report["grids"][0]
            made |= {f"effort {effort}": grid["metrics"]["psnr_active"], f"stored, {effort}": grid["representation"]["stored"],
                     f"seconds, {effort}": process.user_seconds}
        return [made]

    points = csv.DictReader((ROOT / "docs/figures/external_points.csv").open())
    for point in points:
        name = names.get(point["dataset"], point["dataset"])
        if point["method"].startswith("SPERR") and name in bench.chosen(SPEED):
            yield (name, point["bytes"]), partial(row, point, name)


def search(bench):
    """The search beside the simplest one: a short fit, and a whole one of as many ellipsoids as it calls for
    (docs/figures/search.md). Both run on two threads of a CPU and measure values.
    """
    def timed(name, *options):
        file = bench.out / "search.esvr"
        report, process = bench.report("vdb2esvr", bench.volume(name), file, *grid_of(name), *options, "--threads", 2,
                                       "--device", "cpu", allowed=(0, 2, 4))
        if not report["grids"] or report["error"]:
            return None
        grid = report["grids"][0]
        return {"bytes": file.stat().st_size, "seconds": process.user_seconds, "psnr_box": grid["metrics"]["psnr_box"],
                "psnr_active": grid["metrics"]["psnr_active"], "stored": grid["representation"]["stored"], "active": grid["source"]["active_voxels"]}

    def simplest(name, goal, wanted, found):
        """Two fits without a tone curve and with the signs of the values, as a user makes them who knows what ESVR costs."""
        voxels = found["active"]
        if goal.startswith("ratio"):
            return timed(name, "--count", max(int(found["bytes"] / BYTES_EACH), 1))
        first = min(voxels // 35, 6000)
        short = timed(name, "--count", max(first, 1), "--iterations", 100)
        reached = short["psnr_active" if goal == "preset" else "psnr_box"]
        if reached is None:  # exact
            return short
        count = min(first * 2 ** ((wanted - reached - GAIN_OF_WHOLE) / DB_PER_DOUBLING), voxels / 8)
        whole = timed(name, "--count", max(int(count), 1))
        return {**whole, "seconds": short["seconds"] + whole["seconds"]}

    def rows(name, goal):
        found = timed(name, *SEARCHED[goal])
        if found is None:
            return []
        wanted = 40.0 if goal == "preset" else float(goal.split()[1])
        return [{"volume": name, "goal": goal, "row": row, **made} for row, made in
                (("search", found), ("simplest", simplest(name, goal, wanted, found)))]

    for name in bench.chosen(SPEED + ["neuron_m207"]):
        for goal in SEARCHED:
            yield (name, goal), partial(rows, name, goal)


def seen(bench):
    """Pictures that a person can judge: OUT/seen_NAME.png has smokes in the same bytes (docs/figures/seen.md).

    Each row of a picture is a density: the source, ESVR, ESVR with --tone off and SPERR, all in the bytes of a hundredth of
    the half-float Blosc VDB, or of a 25th where that is small. The opacity is such that the median column of voxels lets 0.5
    or 0.1 of the light through.
    """
    def columns(name):
        """What is compared with the source: titles, files, bytes and volumes."""
        import esvr
        volume, blosc = read_volume(bench, name), bench.out / "seen.vdb"
        volume.save(blosc, overwrite=True)
        size = blosc.stat().st_size // SEEN[name]
        yield "source", bench.volume(name), blosc.stat().st_size, volume
        for title, options in {"ESVR": [], "ESVR, --tone off": ["--tone", "off"]}.items():
            file = bench.out / f"{title}.esvr"
            bench.run("vdb2esvr", bench.volume(name), file, *grid_of(name), "--size", size, *options, "--device", "cpu",
                      "--quiet", "--force")
            yield title, file, file.stat().st_size, esvr.read(file)["density"].to_volume()
        path, taken = rivals.to_size(bench, "SPERR", volume, size)
        yield "SPERR", path, taken, esvr.Volume.from_vdb(path)

    def drawn(path, options, preset):
        from matplotlib import pyplot
        picture = bench.out / "seen.png"
        bench.run("esvr-render", path, picture, *options, "--resolution", f"{SEEN_SIDE}x{SEEN_SIDE}", "--tf", preset,
                  "--range", "own", "--background", "0.05,0.07,0.1", "--device", "cpu", "--force")
        return pyplot.imread(picture)

    def sheet(name):
        import esvr
        from matplotlib import pyplot
        made = list(columns(name))
        volume = made[0][3]
        rows = [{"volume": name, "row": title, "bytes": taken, "psnr_t50": figures.psnr_t50,
                 "psnr_active": figures.psnr_active} for title, _, taken, other in made
                for figures in [esvr.compare(volume, other)] if title != "source"]
        depth, high = esvr.compare(volume, volume).median_depth, volume.value_range[1]
        figure, axes = pyplot.subplots(len(SEEN_LIGHT), len(made), figsize=(3.3 * len(made), 3.5 * len(SEEN_LIGHT)))
        for line, light in zip(axes, SEEN_LIGHT):
            preset = rivals.write_smoke_preset(bench.out / "seen.json", high, -math.log(light) / depth)
            for axis, (title, path, _, _) in zip(line, made):
                axis.imshow(drawn(path, grid_of(name) if title == "source" else [], preset))
                axis.axis("off")
        axes[0][0].set_title(f"source: {made[0][2]:,} bytes", fontsize=9)
        for axis, row in zip(axes[0][1:], rows):
            axis.set_title(f"{row['row']}: {row['bytes']:,} bytes\nT 0.5 {row['psnr_t50']:.1f} dB, "
                           f"active {row['psnr_active']:.1f} dB", fontsize=9)
        figure.tight_layout()
        figure.savefig(bench.out / f"seen_{name}.png", dpi=110)
        return rows

    for name in bench.chosen(SEEN):
        yield (name,), partial(sheet, name)


def averages(source, coarse):
    """The voxels of a coarse volume over its box, and the averages of the source over their space, in float64."""
    import numpy as np
    margin = 16  # voxels of the background
    first, last = (np.array(corner) for corner in source.box)
    first = first - margin
    expected = source.to_numpy((tuple(first), tuple(last + margin))).astype(np.float64)
    low, high = (np.array(corner) for corner in coarse.box)
    to_fine = np.linalg.inv(source.transform) @ coarse.transform
    for axis in range(3):
        width = to_fine[axis, axis]
        centers = width * np.arange(low[axis], high[axis] + 1) + to_fine[axis, 3]
        at = first[axis] + np.arange(expected.shape[axis])
        overlap = np.minimum((centers + width / 2)[:, None], at + 0.5) - np.maximum((centers - width / 2)[:, None], at - 0.5)
        expected = np.moveaxis(np.tensordot(np.maximum(overlap, 0.0) / width, expected, (1, axis)), 0, axis)
    return coarse.to_numpy((tuple(low), tuple(high))).astype(np.float64), expected


def coarser(bench):
    """Coarser grids of esvr2vdb --coarsen beside those of OpenVDB's vdb_lod (docs/figures/benchmarks.md).

    vdb_lod reads the source, and esvr2vdb a lossless file, a file with --max-error 1%, and ellipsoids. Errors are relative to
    the range of the source, against its average over the space of each coarse voxel, at the places that the transform of the
    output says.
    """
    def row(name, factor, program, process, path, source):
        import esvr
        import numpy as np
        made, expected = averages(source, esvr.Volume.from_vdb(path))
        low, high = source.value_range
        error = np.abs(made - expected) / (max(high, source.background) - min(low, source.background))
        return {"file": name, "factor": factor, "program": program, "bytes": path.stat().st_size, "seconds": process.seconds,
                "largest error": float(error.max()), "RMS error": float(np.sqrt((error ** 2).mean()))}

    def rows(name):
        import esvr
        source, path = esvr.Volume.from_vdb(bench.volume(name)), bench.out / "coarse.vdb"
        files = {kind: bench.out / f"{kind}.esvr" for kind in COARSER}
        for kind, goal in COARSER.items():
            bench.run("vdb2esvr", bench.volume(name), files[kind], "--force", *goal)
        for level in (1, 2, 3):
            process = call(bench.rival("vdb_lod"), bench.volume(name), path, "-range", level, "-p")
            yield row(name, 2 ** level, "vdb_lod", process, path, source)
            for kind in COARSER:
                process = bench.run("esvr2vdb", files[kind], path, "--force", "--coarsen", 2 ** level)
                yield row(name, 2 ** level, f"esvr2vdb, {kind}", process, path, source)

    for name in bench.chosen(["smoke1", "wdas_cloud_sixteenth", "dragon_with_xform"]):
        yield (name,), partial(rows, name)


def missing(bench):
    """What NaN voxels cost with --nonfinite keep --max-error 1%, in a ball or at random (docs/convert.md)."""
    def rows(name):
        import esvr
        import numpy as np
        source, made = esvr.Volume.from_vdb(bench.volume(name)), bench.out / "missing.vdb"
        values = source.to_numpy()
        active = np.argwhere(values != source.background)
        far = np.linalg.norm(active - np.array(values.shape) / 2, axis=1)
        orders = {"in a ball": np.argsort(far, kind="stable"), "at random": np.random.default_rng(1).permutation(len(active))}
        for place, order in orders.items():
            for share in (0.0, 0.01, 0.2):
                gaps = values.copy()
                gaps[tuple(active[order[:int(share * len(active))]].T)] = np.nan
                esvr.Volume.from_numpy(gaps, background=source.background, nonfinite="keep").save(made, overwrite=True)
                report, _ = bench.report("vdb2esvr", made, bench.out / "missing.esvr", "--nonfinite", "keep", "--max-error", "1%")
                grid = report["grids"][0]
                kept = grid["source"]["nonfinite_kept"] or {"nan": 0, "bytes": 0}
                yield {"volume": name, "NaN voxels": kept["nan"], "where": place, "bytes of their places": kept["bytes"],
                       "bytes of the rest": grid["bytes"] - kept["bytes"]}
    for name in bench.chosen(["smoke1"]):
        yield (name,), partial(rows, name)
