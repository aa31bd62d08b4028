"""How well cheap measures of a volume predict what Cycles shows of it (docs/figures/calibration.md).

`bench.py run calibration` converts each smoke in several ways, lets Cycles draw the source and all results at three
densities, and writes the differences of the pictures and of the volumes to OUT/calibration.json, and the pictures to
OUT/cycles_SMOKE.png. It needs Blender 3.4, SPERR 0.8.5 and the Python module.
"""
import json
import math
import pathlib
import sys
from functools import partial

import numpy as np

import rivals
from bench import call, table, write_page

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "metrics"))
import make_flip_fixture as flip_of_paper  # noqa: the path must be known first

# ESVR was not tuned with the last two, nor with double_grid.
SMOKES = ["smoke1", "wdas_cloud_sixteenth", "double_grid", "dragon_with_xform", "gas_0003", "gas_0006", "fluid_data_0041",
          "fluid_data_0071", "plume_112", "blobs_88"]
# Parts of the bytes of the half-float Blosc VDB. Small files hold little but headers at a hundredth.
PARTS = {"low": 100, "middle": 50, "high": 25}
SMALL, SMALL_PARTS = 150_000, {"low": 25, "middle": 18, "high": 10}
DROPPED = 0.05     # of the mass, in the faintest voxels
SAMPLES = {0.9: 80, 0.5: 40, 0.1: 40}  # of a pixel, for each of two seeds. Pictures of thin smoke have the most noise
LIGHT = tuple(SAMPLES)  # through the median column, as in transmittancePsnr (esvr/metrics.h)
SIDE = 96  # pixels
PIXELS_PER_DEGREE = 0.7 * 3840 / 0.7 * math.pi / 180  # of FLIP's usual viewer
UNLIKE = 1.0       # dB between the pictures of two results, above which they have an order
# In the order of the page. Those that depend on the density are computed for each picture.
MEASURES = {"t90": "T 0.9", "t50": "T 0.5", "t10": "T 0.1", "t_same": "T at the density of the picture",
            "t_filled": "the same, over columns that are not empty in the source",
            "t_body": "the same, errors of all columns for each that is not empty",
            "t_exposed": "the same, exposed",
            "t_display": "the same, in the values of a display",
            "lit": "light that is scattered once, for each such column, exposed",
            "lit_display": "the same, in the values of a display",
            "active": "values, active voxels", "box": "values, box", "sqrt": "square roots of values, active voxels",
            "log": "logarithms of values, active voxels", "ssim": "SSIM of values, as -10 log10(1 - SSIM)"}

# In tables and charts of fewer measures.
SHOWN = {"t_same": "T", "t_exposed": "T, exposed", "t_display": "T, display", "active": "active", "ssim": "SSIM"}
CERTAIN = 3.0      # standard errors that the squared error of pictures must have

ROWS = """\
{rows} rows, pictures of a source and a result, were compared ({each} for T = {light}). {left_out} others were left out.

"""
BY_SMOKE = """\
## Each smoke

The share of the pairs of results of one smoke whose pictures a measure puts in order. *T* is that of the density of the
picture; exposed, it differs from that by a constant.

"""
BY_RESULT = """\
## Where measures are wrong

How far the pictures of a kind of result are from the regression line of all rows, in dB on average. Above 0, pictures are
better than the measure says.

"""
NOISE = """\
## Noise

PSNR and FLIP of two pictures of the source with different seeds. Two pictures of one seed share most of their noise.

"""


def psnr(squares, peak=1.0):
    """dB; nothing if there is no error, or less than noise."""
    mean = float(np.mean(squares, dtype=np.float64))
    return -10 * math.log10(mean / peak ** 2) if mean > 0 else None


def display(light):
    """The sRGB values of linear light."""
    light = np.clip(light, 0, 1)
    return np.where(light > 0.0031308, 1.055 * light ** (1 / 2.4) - 0.055, 12.92 * light)


# Measures of volumes. An array has the voxels of the box of the source's active voxels, none of them below 0.

def columns(array):
    """The sums along each axis, one after the other."""
    return np.concatenate([array.sum(axis, dtype=np.float64).ravel() for axis in range(3)])


def lit(array, k):
    """Three pictures of the light that comes along an axis and is scattered once towards the next axis."""
    opacity = -np.expm1(-k * array)
    before = [np.exp(-k * (np.cumsum(array, axis, dtype=np.float32) - array / 2)) for axis in range(3)]
    return np.concatenate([(opacity * before[axis] * before[(axis + 1) % 3]).sum(axis, dtype=np.float64).ravel()
                           for axis in range(3)])


def of_light(source, made, k):
    """The measures that depend on a density. T is the mean over all columns. From `t_body` on, the errors of all columns are
    divided by the number of those that are not empty, so that space around a smoke does not count."""
    depth = columns(source)
    filled = depth > 1e-3 * source.max()
    opacities = [-np.expm1(-k * depth), -np.expm1(-k * columns(made))]
    scattered = [lit(source, k), lit(made, k)]
    squares = (opacities[0] - opacities[1]) ** 2

    def body(pair, shown):
        a, b = (shown(picture / pair[0].max()) for picture in pair)
        return psnr((a - b) ** 2 / filled.mean())
    return {"t_same": psnr(squares), "t_filled": psnr(squares[filled]), "t_body": psnr(squares / filled.mean()),
            "t_exposed": body(opacities, np.asarray), "t_display": body(opacities, display),
            "lit": body(scattered, np.asarray), "lit_display": body(scattered, display)}


def of_values(volume, made, source, array):
    import esvr
    figures = esvr.compare(volume, made, ssim=True)
    inside, peak = volume.active(), figures.peak
    faint = peak / 1000
    logs = np.log10(np.maximum(source[inside], faint)) - np.log10(np.maximum(array[inside], faint))
    finite = lambda decibels: decibels if math.isfinite(decibels) else None  # noqa: E731
    return {"t90": finite(figures.psnr_t90), "t50": finite(figures.psnr_t50), "t10": finite(figures.psnr_t10),
            "active": finite(figures.psnr_active), "box": finite(figures.psnr_box),
            "ssim": -10 * math.log10(1 - figures.ssim) if figures.ssim < 1 else None,
            "sqrt": psnr((np.sqrt(source[inside]) - np.sqrt(array[inside])) ** 2, math.sqrt(peak)),
            "log": psnr(logs ** 2, 3.0)}


def of_pictures(source, made, exposure):
    """Differences of pictures, which are drawn with one seed or more, and exposed such that the source just has white.

    The random numbers of two seeds are independent, so that the product of the differences that they show has the mean
    of the squared difference without noise. FLIP is that of the averages of all seeds.
    """
    source, made = ([exposure * picture.astype(float) for picture in seeds] for seeds in (source, made))
    differences = [a - b for a, b in zip(source, made)]
    squares = (differences[0] * differences[-1]).mean(axis=2)
    error = float(squares.std()) / math.sqrt(squares.size)
    means = [display(sum(seeds) / len(seeds)) for seeds in (source, made)]
    return {"psnr": psnr(squares), "standard_errors": float(squares.mean()) / error if error else 0.0,
            "flip": float(flip_of_paper.flip(*means, PIXELS_PER_DEGREE).mean())}


def draw_sheet(shown, results, path):
    """All pictures of a smoke: a row for each density, and the source in front of its results."""
    from matplotlib import pyplot
    figure, axes = pyplot.subplots(len(shown), len(results) + 1, figsize=(2.1 * (len(results) + 1), 2.4 * len(shown)))
    for line, (light, pixels) in zip(axes, shown.items()):
        titles = [f"source, T = {light}"]
        for title, result in results.items():
            at = result["light"][light]
            of_picture, same = at["pictures"], at["measures"]["t_same"]
            titles.append(f"{title}\nPSNR {cell(of_picture['psnr'], 1)}, FLIP {of_picture['flip']:.3f}, T {cell(same, 1)}")
        for axis, title, picture in zip(line, titles, pixels):
            axis.imshow(picture, origin="lower")
            axis.set_title(title, fontsize=7)
            axis.axis("off")
    figure.tight_layout()
    figure.savefig(path, dpi=75)
    pyplot.close(figure)


def by_esvr(bench, source, size, *options):
    import esvr
    file, back = bench.out / "made.esvr", bench.out / "made.vdb"
    bench.run("vdb2esvr", source, file, "--grid", "density", "--size", size, *options, "--device", "cpu", "--threads", 1,
              "--quiet", "--force")
    bench.run("esvr2vdb", file, back, "--quiet", "--force")
    return esvr.Volume.from_vdb(back, "density"), file.stat().st_size


def results_of(bench, source, volume):
    """Title, volume and bytes of each result."""
    import esvr
    blosc = bench.out / "made.vdb"
    volume.save(blosc, overwrite=True)
    whole = blosc.stat().st_size
    size = {name: whole // part for name, part in (SMALL_PARTS if whole < SMALL else PARTS).items()}
    for_values = ["--measure", "values", "--representation"]
    yield "ESVR, low", *by_esvr(bench, source, size["low"])
    yield "ESVR, high", *by_esvr(bench, source, size["high"])
    yield "ellipsoids for values", *by_esvr(bench, source, size["middle"], *for_values, "ellipsoids")
    yield "voxels for values", *by_esvr(bench, source, size["middle"], *for_values, "voxels")
    path, taken = rivals.to_size(bench, "SPERR", volume, size["middle"])
    yield "SPERR", esvr.Volume.from_vdb(path), taken
    values = np.sort(volume.to_numpy(), axis=None)
    least = values[np.searchsorted(np.cumsum(values, dtype=np.float64), DROPPED * values.sum(dtype=np.float64))]
    array = volume.to_numpy()
    array[array <= least] = 0
    yield "faint voxels dropped", esvr.Volume.from_numpy(array, origin=list(volume.box[0])), None


def draw_with_cycles(bench, jobs):
    """The pictures of jobs: an array, a density, a seed and samples each."""
    import esvr
    drawn, volumes = [], {}
    for i, (array, density, seed, samples) in enumerate(jobs):
        if id(array) not in volumes:
            volumes[id(array)] = bench.out / f"drawn_{len(volumes)}.vdb"
            esvr.Volume.from_numpy(array).save(volumes[id(array)], overwrite=True)
        drawn.append({"volume": str(volumes[id(array)]), "density": density, "seed": seed, "samples": samples,
                      "out": str(bench.out / f"drawn_{i}.npy")})
    job = bench.out / "job.json"
    job.write_text(json.dumps({"side": SIDE, "pictures": drawn}))
    call("blender", "--background", "--factory-startup", "--python-exit-code", 1, "--python", HERE / "cycles.py", "--", job)
    return [np.load(picture["out"]) for picture in drawn]


def figures_of(bench, name):
    """All figures of a smoke."""
    import esvr
    path = bench.volume(name)
    volume = esvr.Volume.from_vdb(path, "density")
    source = np.maximum(volume.to_numpy(), 0)
    depth = esvr.compare(volume, volume).median_depth
    made = [(title, back, np.maximum(back.to_numpy(volume.box), 0), taken)
            for title, back, taken in results_of(bench, path, volume)]
    k = {light: -math.log(light) / depth for light in LIGHT}
    arrays = [source, *(array for _, _, array, _ in made)]
    drawn = iter(draw_with_cycles(bench, [(array, k[light], seed, SAMPLES[light])
                                          for light in LIGHT for seed in (1, 2) for array in arrays]))
    results = {title: {"bytes": taken, "values": of_values(volume, back, source, array), "light": {}}
               for title, back, array, taken in made}
    noise, shown = {}, {}
    for light in LIGHT:
        seeds = [[next(drawn) for _ in arrays] for _ in (1, 2)]
        exposure = 1 / float(seeds[0][0].max())
        noise[light] = of_pictures([seeds[0][0]], [seeds[1][0]], exposure)
        shown[light] = [display(exposure * (a + b) / 2) for a, b in zip(*seeds)]
        for i, (title, _, array, _) in enumerate(made, 1):
            results[title]["light"][light] = {
                "measures": of_light(source, array, k[light]),
                "pictures": of_pictures(*([seed[j] for seed in seeds] for j in (0, i)), exposure)}
    draw_sheet(shown, results, bench.out / f"cycles_{name}.png")
    return {"voxels": volume.active_voxels, "noise": noise, "results": results}


def calibration(bench):
    """Measures of volumes beside Cycles' pictures of them (docs/figures/calibration.md)."""
    for name in bench.chosen(SMOKES):
        yield (name,), partial(figures_of, bench, name)


# The page.

def ranks(values):
    """Places in ascending order; equal values share the mean of theirs."""
    _, where, counts = np.unique(values, return_inverse=True, return_counts=True)
    return (np.cumsum(counts) - (counts - 1) / 2)[where]


def correlation(x, y):
    """Pearson's; nothing where one of both does not vary."""
    return float(np.corrcoef(x, y)[0, 1]) if len(x) > 2 and np.ptp(x) > 0 and np.ptp(y) > 0 else None


def rank_correlation(x, y):
    return correlation(ranks(x), ranks(y))


def residual(x, y):
    """The standard deviation of y around its regression line on x."""
    r = correlation(x, y)
    return float(np.std(y) * math.sqrt(1 - r * r))


def in_order(rows, measure, figure):
    """How many pairs of results of a smoke at a density a measure puts in the order of their pictures, and of how many."""
    right = pairs = 0
    for i, a in enumerate(rows):
        for b in rows[:i]:
            seen = a[figure] - b[figure]
            if (a["smoke"], a["light"]) == (b["smoke"], b["light"]) and abs(seen) > UNLIKE:
                pairs += 1
                right += (a[measure] - b[measure]) * seen > 0
    return right, pairs


def percent(right, pairs):
    return f"{100 * right / pairs:.0f} %" if pairs else "-"


def rows_of(done):
    """A row for each smoke, result and density whose difference is seen in spite of the noise of the pictures."""
    rows, left_out = [], 0
    for smoke, figures in done.items():
        for title, result in figures["results"].items():
            for light, at in result["light"].items():
                measures = {**result["values"], **at["measures"]}
                if at["pictures"]["standard_errors"] < CERTAIN or None in measures.values():
                    left_out += 1
                    continue
                rows.append({"smoke": smoke, "title": title, "light": light, "PSNR": at["pictures"]["psnr"],
                             "FLIP": -20 * math.log10(at["pictures"]["flip"]), **measures})
    return rows, left_out


def cell(value, digits=2):
    return "-" if value is None else f"{value:.{digits}f}"


def of(rows, **wanted):
    return [row for row in rows if all(row[key] == value for key, value in wanted.items())]


def pairs_of(rows, measure, figure):
    return np.array([row[measure] for row in rows]), np.array([row[figure] for row in rows])


def over_all(rows, figure):
    lines = []
    for measure, title in MEASURES.items():
        x, y = pairs_of(rows, measure, figure)
        lines.append([title, *(cell(correlation(*pairs_of(of(rows, light=str(light)), measure, figure))) for light in LIGHT),
                      cell(correlation(x, y)), cell(rank_correlation(x, y)), cell(residual(x, y), 1),
                      percent(*in_order(rows, measure, figure))])
    return table(["measure", *(f"r, T = {light}" for light in LIGHT), "r", "rank correlation", "off by dB", "pairs in order"],
                 lines)


def by_smoke(rows, done):
    lines = []
    for smoke, figures in done.items():
        own, line = of(rows, smoke=smoke), [smoke, f"{figures['voxels']:,}"]
        for figure in ("PSNR", "FLIP"):
            found = [in_order(own, measure, figure) for measure in SHOWN if measure != "t_exposed"]
            line += [str(found[0][1]), *(percent(*shares) for shares in found)]
        lines.append(line)
    names = [name for measure, name in SHOWN.items() if measure != "t_exposed"]
    return table(["smoke", "active voxels", *(word for figure in ("PSNR", "FLIP") for word in
                                              (f"{figure}: pairs", *(f"{figure}: {name}" for name in names)))], lines)


def by_result(rows):
    """How far each kind of result is from the line of all rows."""
    lines = []
    for title in dict.fromkeys(row["title"] for row in rows):
        line = [title, str(len(of(rows, title=title)))]
        for figure in ("PSNR", "FLIP"):
            for measure in SHOWN:
                slope, begin = np.polyfit(*pairs_of(rows, measure, figure), 1)
                x, y = pairs_of(of(rows, title=title), measure, figure)
                line.append(f"{np.mean(y - slope * x - begin):+.1f}")
        lines.append(line)
    return table(["result", "rows", *(f"{figure}: {name}" for figure in ("PSNR", "FLIP") for name in SHOWN.values())], lines)


def noise_table(done):
    return table(["smoke", *(f"T = {light}" for light in LIGHT)],
                 [[smoke, *(f"{figures['noise'][str(light)]['psnr']:.1f} dB, {figures['noise'][str(light)]['flip']:.3f}"
                            for light in LIGHT)] for smoke, figures in done.items()])


def draw(rows, path):
    import matplotlib
    matplotlib.use("agg")
    from matplotlib import pyplot
    figure, axes = pyplot.subplots(2, len(SHOWN), figsize=(4.2 * len(SHOWN), 8), sharey="row")
    for line, seen in zip(axes, ("PSNR", "FLIP")):
        for axis, (measure, name) in zip(line, SHOWN.items()):
            for title, marker in zip(dict.fromkeys(row["title"] for row in rows), "os^vXD"):
                for light, color in zip(LIGHT, ("#38bdf8", "#2563eb", "#172554")):
                    x, y = pairs_of(of(rows, title=title, light=str(light)), measure, seen)
                    axis.scatter(x, y, 26, color, marker, alpha=0.75, linewidths=0,
                                 label=title if light == LIGHT[1] else None)
            axis.set(xlabel=f"{name}, dB")
            axis.grid(alpha=0.3)
        line[0].set_ylabel("PSNR of Cycles' pictures, dB" if seen == "PSNR" else "-20 log10 of their FLIP, dB")
    axes[0][0].legend(fontsize=8, title="light, middle, dark: T = 0.9, 0.5, 0.1", title_fontsize=8)
    figure.tight_layout()
    figure.savefig(path, dpi=80)


def page(docs):
    done = json.loads((docs / "figures/calibration.json").read_text())
    rows, left_out = rows_of(done)
    text = ROWS.format(rows=len(rows), left_out=left_out, light=", ".join(map(str, LIGHT)),
                       each=", ".join(str(len(of(rows, light=str(light)))) for light in LIGHT))
    text += f"## PSNR of the pictures\n\n{over_all(rows, 'PSNR')}\n## FLIP of the pictures\n\n{over_all(rows, 'FLIP')}\n"
    text += BY_SMOKE + by_smoke(rows, done) + "\n" + BY_RESULT + by_result(rows) + "\n" + NOISE + noise_table(done)
    write_page(docs / "figures/calibration.md", text)
    draw(rows, docs / "img/calibration.png")
