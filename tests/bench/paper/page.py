#!/usr/bin/env python3
"""Writes docs/paper.md from page.md, which is its text, and from the figures in docs/paper.

    page.py [--docs DOCS]

The figures are those of measure.py and of `paper_volumes.py statistics --report`.
"""
import argparse
import json
import pathlib
import sys

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[2]
sys.path.insert(0, str(HERE.parent))
from rates import psnr, text  # noqa: E402
from svg_panels import Line, Panel, draw  # noqa: E402

TITLES = {"aneurysm": "Aneurysm", "breast": "Breast", "neuron": "Neuron", "bigbrain": "BigBrain",
          "woodbranch": "Woodbranch", "vdeltaa": "Hemibrain (vDeltaA)", "lln2p": "Hemibrain (lLN2P)",
          "beechnut": "Beechnut", "pigheart": "Pigheart"}
DENSE = ("neuron", "bigbrain", "woodbranch", "beechnut", "pigheart")
# The forms of the tables at one size: a column, and the rows of which it shows the best.
AT_SIZE = {"Instant-NGP": ("Instant-NGP x 1",), "SPERR": ("SPERR",), "SZ3": ("SZ3",), "TTHRESH": ("TTHRESH",),
           "ZFP": ("ZFP accuracy", "ZFP precision"), "OpenVDB, lossy": ("OpenVDB half Blosc",),
           "NanoVDB, lossy": ("NanoVDB FpN Zip", "NanoVDB Fp4 Zip", "NanoVDB Fp8 Zip", "NanoVDB Fp16 Zip",
                              "NanoVDB float Zip")}
AT_PSNR = {"SPERR": ("SPERR",), "SZ3": ("SZ3",), "TTHRESH": ("TTHRESH",), "ZFP": ("ZFP accuracy", "ZFP precision"),
           "NanoVDB, lossy": ("NanoVDB FpN Zip",)}
# The paper's ablations: PSNR after pruning (tables 'Primitive type', 'Pruning score', 'k', 'Pruning performance').
PAPER = {"aneurysm": {"ellipsoid": 50.70, "gaussian": 48.16, "score no-fa": 49.41, "score only-fa": 50.23,
                      "score none": 44.91, "score rays": 48.76, "k 3": 48.73, "k learned": 49.76},
         "breast": {"ellipsoid": 45.62, "gaussian": 45.04, "score no-fa": 45.46, "score only-fa": 45.77,
                    "score none": 46.43}}
RUNS = {"ellipsoid": "ellipsoids, k = 5, the full score", "gaussian": "Gaussians", "score no-fa": "score without FA",
        "score only-fa": "score of FA alone", "score rays": "score of LightGaussian",
        "score none": "no pruning, about as many ellipsoids", "k 3": "k = 3", "k learned": "k learned"}
COLORS = ("#3b7dd8", "#d8743b", "#3fa66b", "#9a5fc0")


def table(header, rows):
    """A Markdown table whose first column is text."""
    lines = ["| " + " | ".join(header) + " |", "|---|" + "--:|" * (len(header) - 1)]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows])


def count(value):
    return f"{value:,}"


def milliseconds(seconds):
    return f"{1000 * seconds:.1f}"


def best(rows, names, key="psnr_box"):
    """The row of one of these names with the highest figure."""
    found = [row for row in rows if row["name"] in names and psnr(row, key) is not None]
    return max(found, key=lambda row: psnr(row, key), default=None)


class Figures:
    """What was measured of a volume."""

    def __init__(self, name, parts):
        self.name, self.title = name, TITLES[name]
        self.volume = parts["volumes"][name]
        self.compressors = parts["compressors"].get(name, {"rows": []})["rows"]
        self.ngp = parts["ngp"].get(name, {"looks": {}})["looks"]
        self.ours = next(row for row in self.volume["rows"] if row["group"] == "ESVR")

    def ngp_rows(self):
        return next(iter(self.ngp.values()), [])

    def at_size(self):
        """All rows of other forms of at most our size."""
        group = f"at {self.volume['bytes']} bytes"
        rows = [row for row in self.volume["rows"] + self.compressors if row["group"] == group]
        return rows + [row for row in self.ngp_rows() if row["name"] == "Instant-NGP x 1"]

    def at_psnr(self):
        """The smallest files of other forms that reach our PSNR."""
        return [row for row in self.volume["rows"] + self.compressors if row["group"].endswith(" dB")]

    def smallest_ngp(self):
        """The smallest file of Instant-NGP that reaches our PSNR, or None."""
        reached = [row for row in self.ngp_rows() if row["psnr_box"] >= self.ours["psnr_box"]]
        return min(reached, key=lambda row: row["bytes"], default=None)

    def paper_row(self, name, look="viridis:linear"):
        return next(row for row in self.volume["looks"][look] if row["name"] == f"{name}.esvr")


def bold_best(cells, values):
    """The cells, with the highest of the values in bold. None is no value."""
    top = max((v for v in values if v is not None), default=None)
    return [f"**{cell}**" if value is not None and value == top else cell for cell, value in zip(cells, values)]


def size_matched(figures):
    rows = []
    for f in figures:
        found = [best(f.at_size(), names) for names in AT_SIZE.values()]
        values = [psnr(f.ours), psnr(f.paper_row("pruned")), *(psnr(row) if row else None for row in found)]
        rows.append([f.title, count(f.volume["bytes"]), *bold_best([text(v) for v in values], values)])
    return table(["data set", "our bytes", "ESVR", "the paper's method", *AT_SIZE], rows)


def times_ours(row, ours):
    return f"{row['bytes'] / ours:.1f}" if row else "-"


def psnr_matched(figures):
    rows = []
    for f in figures:
        ours = f.volume["bytes"]
        cells = [times_ours(min((r for r in f.at_psnr() if r["name"] in names and "bytes" in r),
                                key=lambda r: r["bytes"], default=None), ours) for names in AT_PSNR.values()]
        ngp = f.smallest_ngp()
        largest = max(f.ngp_rows(), key=lambda row: row["bytes"], default=None)
        cells.insert(0, times_ours(ngp, ours) if ngp or not largest else f"> {times_ours(largest, ours)}")
        rows.append([f.title, text(f.ours["psnr_box"]), count(ours), *cells])
    return table(["data set", "PSNR", "our bytes", "Instant-NGP", *AT_PSNR], rows)


def picture_cell(row):
    return f"{text(psnr(row, 'image_psnr'), 1)} / {row['image_ssim']:.4f} / {row['flip']:.4f}" if row else "-"


def pictures(figures, look):
    rows = []
    for f in figures:
        shown = [*(f.paper_row(name, look) for name in ("unpruned", "pruned", "ours")),
                 best(f.ngp.get(look, []), ("Instant-NGP x 1",))]
        if look == "viridis:linear":
            shown += [best(f.at_size(), AT_SIZE[name]) for name in ("SPERR", "SZ3")]
        rows.append([f.title, *map(picture_cell, shown)])
    header = ["data set", "the paper's method without pruning", "with pruning", "ESVR", "Instant-NGP"]
    return table(header + (["SPERR", "SZ3"] if look == "viridis:linear" else []), rows)


def drawing(figures):
    rows = []
    for f in figures:
        whole = f.volume["speeds"]["whole"]
        drawn, reference, sum_of = whole["drawn"], whole["reference"], f.volume["speeds"].get("1", {}).get("drawn")
        cells = [f"{drawn['fps']:.0f}", f"{reference['fps']:.0f}", f"{drawn['fps'] / reference['fps']:.1f}",
                 f"{drawn['bytes'] / 1e6:.0f}", f"{reference['bytes'] / 1e6:.0f}"]
        cells += [f"{sum_of['fps']:.0f}", f"{sum_of['bytes'] / 1e6:.0f}"] if sum_of else ["-", "-"]
        rows.append([f.title, *cells])
    return table(["data set", "ESVR, FPS", "NanoVDB, FPS", "ratio", "ESVR, MB", "NanoVDB, MB", "sum of ellipsoids, FPS",
                  "MB"], rows)


def depth_parts(figures):
    rows = []
    for f in figures:
        parts = {int(n): speed["drawn"] for n, speed in f.volume["speeds"].items() if n != "whole"}
        rows.append([f.title, *(f"{parts[n]['fps']:.0f} / {parts[n]['bytes'] / 1e6:.0f}" for n in sorted(parts))])
    return table(["data set", *(f"{n}" for n in sorted(parts))], rows)


def fits(figures):
    rows = []
    for f in figures:
        paper = f.volume["paper"]
        ngp = best(f.at_size(), ("Instant-NGP x 1",))
        rows.append([f.title, count(f.volume["active_voxels"]), count(f.volume["ellipsoids"]),
                     f"{f.volume['seconds']:.1f}", text(f.ours["psnr_box"]), f"{paper['pruned']['seconds']:.1f}",
                     text(f.paper_row("pruned")["psnr_box"]),
                     *([f"{ngp['encode_s']:.1f}", text(ngp["psnr_box"])] if ngp else ["-", "-"])])
    return table(["data set", "active voxels", "ellipsoids", "ESVR, s", "dB", "the paper's method, s", "dB",
                  "Instant-NGP, s", "dB"], rows)


def totals(figures):
    """Compression, decompression and one picture. Voxels of other forms are drawn from NanoVDB."""
    rows = []
    for f in figures:
        picture_s = 1 / f.volume["speeds"]["whole"]["reference"]["fps"]
        ours = [f.volume["seconds"], f.ours["decode_s"], 1 / f.volume["speeds"]["whole"]["drawn"]["fps"]]
        cells = [f"{ours[0]:.1f} + {ours[1]:.3f} + {ours[2]:.4f}"]
        for names in (AT_SIZE["SPERR"], AT_SIZE["SZ3"], AT_SIZE["TTHRESH"], AT_SIZE["ZFP"], AT_SIZE["NanoVDB, lossy"]):
            row = best(f.at_size(), names)
            cells.append(f"{row['encode_s']:.2f} + {row['decode_s']:.3f} + {picture_s:.4f}" if row else "-")
        rows.append([f.title, *cells])
    return table(["data set", "ESVR", "SPERR", "SZ3", "TTHRESH", "ZFP", "NanoVDB, lossy"], rows)


def lossless(figures):
    names = ("OpenVDB float Blosc", "OpenVDB float Zip", "NanoVDB float raw", "NanoVDB float Zip")
    rows = []
    for f in figures:
        sizes = {row["name"]: row["bytes"] for row in f.volume["rows"] if row["group"] == "lossless"}
        rows.append([f.title, count(f.volume["bytes"]), text(f.ours["psnr_box"]), *(count(sizes[n]) for n in names)])
    return table(["data set", "ESVR, bytes", "dB", *names], rows)


def ablation(name, rows):
    cells = []
    for key, row in rows.items():
        paper = PAPER[name].get(key)
        cells.append([RUNS[key], count(row["ellipsoids"]), text(row["psnr_box"]), text(paper) if paper else "",
                      f"{row['ssim']:.4f}", text(row["image_psnr"]), f"{row['hits']:.1f}", f"{row['fps']:.0f}"])
    return f"{TITLES[name]}:\n\n" + table(
        ["run", "ellipsoids", "3D PSNR", "the paper's", "3D SSIM", "PSNR of pictures", "hits", "FPS"], cells)


def ablations(measured):
    return "\n\n".join(ablation(name, found["rows"]) for name, found in measured["volumes"].items())


def sharpness(measured):
    sharpnesses = list(next(iter(measured["volumes"].values()))["sharpness"])
    rows = [[TITLES[name], *(text(found["sharpness"][k][-1]["psnr_box"]) for k in sharpnesses)]
            for name, found in measured["volumes"].items()]
    return table(["data set", *(f"k = {k}" for k in sharpnesses)], rows)


def sharpness_picture(measured):
    panels = [Panel(TITLES[name], [Line(f"k = {k}", [(p["seconds"], p["psnr_box"]) for p in points], color)
                                   for (k, points), color in zip(found["sharpness"].items(), COLORS)])
              for name, found in measured["volumes"].items()]
    return draw(panels, "seconds", "PSNR over the box, dB")


def data_sets(statistics):
    rows = []
    for volume in statistics["volumes"]:
        old, new = volume["original"], volume["measured"]
        sides = [" x ".join(map(str, s["resolution"])) for s in (old, new)]
        rows.append([TITLES[volume["name"]], volume["what"], *sides,
                     *(f"{old[key]:g} / {new[key]:.{digits}f}" for key, digits in
                       (("nonzero", 2), ("above", 2), ("screen", 0)))])
    return table(["data set", "stand-in", "resolution", "here", "% not zero", "% above a tenth",
                  "% of the screen"], rows)


def at_best(f):
    """The row of another form with the highest PSNR at our size."""
    return max((row for row in f.at_size() if psnr(row) is not None), key=psnr, default=None)


def margins(figures):
    """A sentence for each volume: how far ESVR is ahead of, or behind, the best other form at its size."""
    lines = []
    for f in figures:
        other = at_best(f)
        if other is None:
            lines.append(f"- {f.title}: no other form has a file of our size.")
            continue
        by = f.ours["psnr_box"] - psnr(other)
        lines.append(f"- {f.title}: ESVR is {abs(by):.2f} dB {'above' if by >= 0 else 'below'} {other['name']}.")
    return "\n".join(lines)


def finding(figures):
    compared = [f for f in figures if at_best(f)]
    won = [f for f in compared if psnr(at_best(f)) < f.ours["psnr_box"]]
    alone = [f.title for f in figures if f not in compared]
    return (f"At equal size, ESVR has the highest PSNR of all forms on {len(won)} of these {len(compared)} volumes."
            + (f" No other form has a file that small for {', '.join(alone)}." if alone else ""))


def better_pictures(figures, look):
    """A line for each other form whose pictures have a higher PSNR than ours at our size."""
    lines = []
    for f in figures:
        ours = psnr(f.paper_row("ours", look), "image_psnr")
        rows = f.ngp.get(look, [])[:1] + (f.at_size() if look == "viridis:linear" else [])
        better = {row["name"]: psnr(row, "image_psnr") for row in rows if (psnr(row, "image_psnr") or 0) > ours}
        lines += [f"- {f.title}, {look}: {name.removesuffix(' x 1')} {value:.1f} dB, ESVR {ours:.1f} dB."
                  for name, value in better.items()]
    return lines


def losses_of_pictures(figures, looks):
    return "\n".join(line for look in looks for line in better_pictures(figures, look)) or "- none"


def span(values):
    """The least and the largest of some seconds, as text."""
    return f"{min(values):.1f} to {max(values):.1f}"


def opening(figures, looks):
    """The figures of the first sentences."""
    sperr = [best(f.at_size(), AT_SIZE["SPERR"]) for f in figures]
    ngp = [best(f.at_size(), AT_SIZE["Instant-NGP"]) for f in figures]
    lost = [bool(better_pictures([f], look)) for f in figures for look in looks]
    return {"FINDING": finding(figures), "SECONDS": span([f.volume["seconds"] for f in figures]),
            "SECONDS_NGP": span([row["encode_s"] for row in ngp if row]),
            "SECONDS_SPERR": span([row["encode_s"] for row in sperr if row]), "LOST_PICTURES": str(sum(lost)),
            "ALL_PICTURES": str(len(lost))}


def parts_of(parts):
    order = [name for name in TITLES if name in parts["volumes"]]
    figures = [Figures(name, parts) for name in order]
    dense = [f for f in figures if f.name in DENSE]
    looks = list(figures[0].volume["looks"])
    return {**opening(figures, looks), "DATA_SETS": data_sets(parts["statistics"]),
            "SIZE_MATCHED": size_matched(figures), "PSNR_MATCHED": psnr_matched(figures),
            "PICTURES": "\n\n".join(f"`--colors {look}`:\n\n{pictures(figures, look)}" for look in looks),
            "BETTER_PICTURES": losses_of_pictures(figures, looks), "DRAWING": drawing(figures),
            "DEPTH_PARTS": depth_parts(figures), "FITS": fits(figures),
            "TOTALS": totals(figures), "LOSSLESS": lossless(figures), "DENSE": margins(dense),
            "ABLATIONS": ablations(parts["ablations"]), "SHARPNESS": sharpness(parts["ablations"])}


NAMES = ("volumes", "compressors", "ngp", "ablations")


def load(docs):
    """The figures of all jobs, the machines, and the statistics of the volumes."""
    files = {name: json.loads((docs / f"paper/{name}.json").read_text()) for name in NAMES
             if (docs / f"paper/{name}.json").exists()}
    parts = {name: files.get(name, {}).get("volumes", {}) for name in NAMES}
    parts["ablations"] = files["ablations"]
    parts["statistics"] = json.loads((docs / "paper/statistics.json").read_text())
    return parts, {f"MACHINE_{name.upper()}": found["machine"] for name, found in files.items()}


def contents(parts, machines):
    """The files of the page, by their paths in docs."""
    page = (HERE / "page.md").read_text()
    for name, part in {**parts_of(parts), **machines}.items():
        page = page.replace("{" + name + "}", part)
    return {"paper.md": page, "img/paper_sharpness.svg": sharpness_picture(parts["ablations"])}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--docs", type=pathlib.Path, default=ROOT / "docs")
    arguments = parser.parse_args()
    for name, content in contents(*load(arguments.docs)).items():
        (arguments.docs / name).write_text(content)


if __name__ == "__main__":
    main()
