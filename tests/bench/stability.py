"""Stiff and extreme cases, and the page docs/figures/stability.md.

`bench.py run stability --device cpu|cuda` runs bench_stability (target of that name, with -DESVR_BUILD_BENCHMARKS=ON), which
writes OUT/cpu.json or OUT/cuda.json; TEXT of --machine describes the machine on the page. `bench.py page stability` has the
figures of both files in docs/figures/stability, and says so where one of them was not measured.
"""
import json
import textwrap

from bench import call, table, write_page

DEVICES = {"cpu": "CPU", "cuda": "CUDA"}
COLORS = {0.5: "#3b82f6", 1.0: "#16a34a", 2.0: "#ea580c"}  # by multiples of the tuned step sizes
IN_CHUNKS = "#a21caf"
ALLOWED = 1e-4       # share of the peak
LOSS = 3.0           # dB, by which a fit is worse than that with the tuned steps
EXACT = 999.0        # dB, which stand for no error
PANELS = 6           # charts of a picture
NOT_MEASURED = "not measured"

# Why a case is beyond float32, and where users meet it.
REASONS = {
    "k = 5000": "its edge lies where m is about 5000, and float32 has an error of m in proportion to m. The default fit keeps "
                "kappa at 30 or below; only `--method paper` makes sharper ellipsoids, and k = 500 passes. "
                "The programs warn of an edge that is sharper than 2000.",
    "denormals": "a GPU takes numbers below 1.2e-38 as 0, so that CUDA draws nothing of a volume whose largest value is below; "
                 "`esvr-render` warns of it. `esvr2vdb` decodes on the CPU and writes such values.",
    "signed data that cancel": "a sum that is 2,487 times smaller than its terms has three digits fewer, in any order. A GPU adds "
                               "in integers, so that the order of threads changes no bit, which costs another unit for each "
                               "term. Both differences are far below the bound. The programs warn of ellipsoids that are "
                               "2000 times as large as the values of their grid.",
}

def section(title, text):
    """The heading and the first paragraph of a section."""
    return f"## {title}\n\n{textwrap.fill(text, 120)}\n\n"


def psnr(value):
    if value is None:
        return "not finite"
    return "exact" if value >= EXACT else f"{value:.1f}"


def number(value):
    return "not finite" if value is None else f"{value:.1e}"


class Figures:
    """The figures of a case on one device."""

    def __init__(self, case):
        self.evaluation, self.gradients, self.fit = case["evaluation"], case["gradients"], case["fit"]

    def share(self, key):
        value = self.evaluation[key]
        return None if value is None else value / self.evaluation["peak"]

    def evaluation_failure(self):
        if not self.evaluation:
            return None
        if self.evaluation["max"] is None:
            return "a value is not finite"
        if self.evaluation["share_of_bound"] > 1:
            return "the evaluation is beyond its bound"
        if self.share("max") > ALLOWED:
            return f"digit {self.evaluation['digits'] + 1} of the evaluation is lost"
        return None

    def gradient_failure(self):
        if not self.gradients:
            return None
        if self.gradients["max"] is None:
            return "a gradient is not finite"
        return "a gradient is beyond its bound" if self.gradients["share_of_bound"] > 1 else None

    def runs(self):
        return {run["factor"]: run for run in self.fit["runs"]} if self.fit else {}

    def is_finite(self):
        return all(r["finite"] and not r["failure"] for r in self.runs().values())

    def diverges(self, factor):
        fitted = self.runs()[factor]
        return bool(fitted["failure"]) or not fitted["finite"] or fitted["psnr"] < self.fit["psnr_of_nothing"]

    def fit_failure(self):
        diverging = [f for f in COLORS if f in self.runs() and self.diverges(f)]
        return f"the fit diverges with {diverging[0]:g} times the step sizes" if diverging else None

    def failures(self):
        found = [self.evaluation_failure(), self.gradient_failure(), self.fit_failure()]
        return [text for text in found if text]

    def first_factor(self, fails):
        """The smallest factor above 1 for which `fails`, as text."""
        factors = [f for f in self.runs() if f > 1]
        if not factors:
            return ""
        return next((f"{f:g}" for f in factors if fails(f)), f"> {max(factors):g}")

    def loses(self, factor):
        runs = self.runs()
        return self.diverges(factor) or runs[factor]["psnr"] < runs[1.0]["psnr"] - LOSS


class Case:
    """A case on all devices that were measured."""

    def __init__(self, case, files):
        self.name, self.detail = case["name"], case["detail"]
        self.on = {}
        for device, content in files.items():
            self.on.update({device: Figures(c) for c in content["cases"] if c["name"] == self.name})

    def any(self):
        return next(iter(self.on.values()))

    def failures(self):
        return [f"{DEVICES[device]}: {text}" for device, f in self.on.items() for text in f.failures()]

    def cells(self, cell):
        """A cell for each device. `cell` makes it from the figures of one."""
        return [cell(self.on[d]) if d in self.on else NOT_MEASURED for d in DEVICES]


def both(text):
    """A heading for each device."""
    return [f"{text}, {device}" for device in DEVICES.values()]


def results(cases):
    rows = [[c.name, *c.cells(lambda f: "fails" if f.failures() else "passes"), "; ".join(c.failures()), c.detail]
            for c in cases]
    return ("## Results\n\n"
            + table(["case", *DEVICES.values(), "what fails", "what is measured"], rows).replace("--:|", "---|"))


def evaluation(cases):
    def row(case):
        figures = case.any()
        return [case.name, f"{figures.evaluation['overlap']}", f"{figures.evaluation['condition']:.1e}",
                f"{figures.evaluation['cancellation']:.1f}",
                *case.cells(lambda f: number(f.share("bound"))), *case.cells(lambda f: number(f.share("max"))),
                *case.cells(lambda f: f"{f.evaluation['digits']}")]
    return (section(
        "Evaluation", "*Overlap* is the largest number of supports that contain a voxel, *condition* the largest "
            "condition number of Sigma, and *cancellation* the sum of the magnitudes of all terms divided by that of "
            "their sums. Bounds and differences are shares of the peak. A hard edge costs digits in proportion to kappa (or "
            "k): it lies where m is about kappa, and m has an error in proportion to itself. The paper's kernel jumps at its "
            "end. Where rounding may decide on which side of the end a voxel lies, the jump is a part of the bound.")
            + table(["case", "overlap", "condition", "cancellation", *both("bound"), *both("difference"),
                     *both("digits")], [row(c) for c in cases if c.any().evaluation]))


def gradients(cases):
    def row(case):
        return [case.name, number(case.any().gradients["bound"]),
                *case.cells(lambda f: number(f.gradients["max"]))]
    return (section("Gradients", "Errors are shares of the sum of the magnitudes of the terms.")
            + table(["case", "bound", *both("error")], [row(c) for c in cases if c.any().gradients]))


def fits(cases):
    def row(case):
        figures = case.any()
        first = figures.runs()[1.0]
        return [case.name, f"{figures.fit['active_voxels']}", f"{first['ellipsoids']}",
                psnr(figures.fit["psnr_of_nothing"]),
                *case.cells(lambda f: psnr(f.runs()[1.0]["psnr"])),
                *case.cells(lambda f: number(f.runs()[1.0]["max_error"])),
                *case.cells(lambda f: f"{f.runs()[1.0]['iterations']}"),
                *case.cells(lambda f: "yes" if f.is_finite() else "no")]
    return (section("Fits", "PSNR is that over the box in dB, at the end and without ellipsoids. The largest error is "
                    "a share of the peak. A fit is *finite* if all parameters and errors are, with all step sizes that were tried.")
            + table(["case", "voxels", "ellipsoids", "PSNR of nothing", *both("PSNR"), *both("largest error"),
                     *both("iterations"), *both("finite")], [row(c) for c in cases if c.any().fit])
            + chunks(cases))


def chunks(cases):
    text = ""
    for case in cases:
        for device, f in case.on.items():
            if f.fit and f.fit["in_one_chunk"]:
                text += "\n" + textwrap.fill(
                    f"The fit of the case \"{case.name}\" has {psnr(f.runs()[1.0]['psnr'])} dB in chunks and "
                    f"{psnr(f.fit['in_one_chunk']['psnr'])} dB in one chunk ({DEVICES[device]}). The step sizes of a fit "
                    "in chunks cannot be changed, so it is not in the section \"Step sizes\".", 120) + "\n"
    return text


def steps(cases):
    measured = [c for c in cases if len(c.any().runs()) > 1]
    factors = list(measured[0].any().runs())

    def row(case, device):
        f = case.on[device]
        return [case.name, DEVICES[device], *[psnr(f.runs()[factor]["psnr"]) for factor in factors],
                f.first_factor(f.loses), f.first_factor(f.diverges)]
    return (section("Step sizes", "The PSNR in dB at the end of fits whose steps are multiples of the tuned ones, the smallest "
            f"multiple above 1 that is {LOSS:g} dB worse than these, and the smallest that diverges.")
            + table(["case", "device", *[f"x {factor:g}" for factor in factors], f"loses {LOSS:g} dB", "diverges"],
                    [row(c, d) for c in measured for d in c.on]))


def lines(case):
    found = []
    for device, figures in case.on.items():
        runs = [(f"steps x {factor:g}", COLORS[factor], r) for factor, r in figures.runs().items() if factor in COLORS]
        if figures.fit and figures.fit["in_one_chunk"]:
            runs = [("in chunks", IN_CHUNKS, figures.runs()[1.0]),
                    ("steps x 1", COLORS[1.0], figures.fit["in_one_chunk"])]
        for name, color, fitted in runs:
            points = [p for p in fitted["curve"] if p[1] is not None and p[1] < EXACT]
            if points:
                found.append((f"{DEVICES[device]}, {name}", points, color, "--" if device != "cpu" else "-"))
    return found


def draw(panels, path):
    """One picture of several charts."""
    import matplotlib  # noqa: only the page needs it
    matplotlib.use("svg")
    matplotlib.rcParams["svg.hashsalt"] = "stability"  # the same names in each run
    from matplotlib import pyplot
    figure, axes = pyplot.subplots((len(panels) + 2) // 3, min(3, len(panels)), figsize=(11, 6), squeeze=False)
    for chart in axes.flat[len(panels):]:
        chart.set_axis_off()
    for chart, (title, drawn) in zip(axes.flat, panels):
        for name, points, color, style in drawn:
            points = [p for p in points if p[0] > 0]
            chart.plot(*zip(*points), style, color=color, marker="o" if len(points) == 1 else None, label=name)
        chart.set_xscale("log")
        chart.set_title(title, fontsize=9)
        chart.grid(alpha=0.3)
        chart.tick_params(labelsize=7)
    named = {l: h for chart in axes.flat for h, l in zip(*chart.get_legend_handles_labels())}
    figure.legend(named.values(), named.keys(), loc="lower center", ncols=4, fontsize=7)
    figure.supylabel("PSNR over the box in dB, over seconds", fontsize=8)
    figure.tight_layout(rect=(0, 0.09, 1, 1))
    figure.savefig(path, metadata={"Date": None})
    pyplot.close(figure)


def curves(cases, folder):
    """Draws the curves. Returns the section of the page."""
    text = (section("Error against run time", "Each curve is a fit; its points are measured during the fit, and the time that "
            "measuring takes counts.").rstrip("\n") + "\n")
    panels = [(c.name, lines(c)) for c in cases if lines(c)]
    for n in range(0, len(panels), PANELS):
        part, file = panels[n:n + PANELS], f"stability_{n // PANELS + 1}.svg"
        draw(part, folder / file)
        text += f"\n![Error against run time: {', '.join(title for title, _ in part)}](../img/{file})\n"
    exact = [c.name for c in cases if c.any().fit and not lines(c)]  # no point has an error
    if exact:
        text += f"\nThere is no curve of {', '.join(exact)}, which is exact from the first point on.\n"
    return text


def machines(files):
    text = "".join(f"- {content['device']}: {content['machine']}\n" for content in files.values())
    missing = [device for device in DEVICES if device not in files]
    for device in missing:
        text += (f"- **{DEVICES[device]} was not measured**: `docs/figures/stability/{device}.json` does not exist. Its columns are "
                 f"marked \"{NOT_MEASURED}\".\n")
    return text + "\n"


def verdict(cases):
    failing = [c for c in cases if c.failures()]
    if not failing:
        return f"**All {len(cases)} cases pass on the devices that were measured.**\n\n"
    names = ", ".join(f'"{c.name}"' for c in failing)
    text = (f"**Of {len(cases)} cases, {len(failing)} {'fails' if len(failing) == 1 else 'fail'}**: {names}. Cases that fail "
            "are the first rows of each table.\n\n")
    known = [textwrap.fill(f"- **{c.name}**: {REASONS[c.name]}", 120, subsequent_indent="  ")
             for c in failing if c.name in REASONS]
    return text + "".join(reason + "\n" for reason in known) + "\n"


def load(figures):
    paths = {device: figures / "stability" / f"{device}.json" for device in DEVICES}
    return {device: json.loads(path.read_text()) for device, path in paths.items() if path.exists()}


def page(docs):
    files = load(docs / "figures")
    if not files:
        raise SystemExit("nothing was measured; run the case stability")
    first = next(iter(files.values()))
    cases = [Case(c, files) for c in first["cases"]]
    cases.sort(key=lambda case: not case.failures())
    sections = [results(cases), evaluation(cases), gradients(cases), fits(cases), steps(cases), curves(cases, docs / "img")]
    write_page(docs / "figures/stability.md", machines(files) + verdict(cases) + "\n".join(sections))


def stability(bench):
    """Evaluation, gradients and fits of extreme cases in float32 on one device (docs/figures/stability.md)."""
    device = "cpu" if bench.device == "auto" else bench.device
    call(bench.bin / "tests/bench/stability/bench_stability", bench.out / f"{device}.json", "--device", device, "--machine",
         bench.arguments.machine)
    return ()  # the program writes all figures
