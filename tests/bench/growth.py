#!/usr/bin/env python3
"""Draws docs/img/growth.svg from the table of the section "Growth" of docs/scale.md.

    growth.py docs/scale.md docs/img/growth.svg
"""
import sys

import matplotlib

matplotlib.use("svg")
from matplotlib import pyplot  # noqa: E402  the backend is chosen first


def rows(path):
    """The rows of the table: active voxels, megabytes of the .esvr file, seconds of the process."""
    lines = open(path, encoding="utf-8").read().split("## Growth")[1].split("\n## ")[0].splitlines()
    for line in lines:
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if line.startswith("| ") and "million" in line:
            yield (float(cells[1].split()[0].replace(",", "")) * 1e6, float(cells[4]),
                   float(cells[9]))


def main():
    source, output = sys.argv[1:]
    matplotlib.rcParams["svg.hashsalt"] = "esvr"  # the same bytes from the same data
    voxels, megabytes, seconds = zip(*rows(source))
    _, panels = pyplot.subplots(1, 2, figsize=(9, 4), constrained_layout=True)
    for panel, values, label in zip(panels, [seconds, megabytes],
                                    ["seconds of the process", "size of the .esvr file, MB"]):
        panel.loglog(voxels, values, "o-")
        panel.loglog(voxels, [values[-2] / voxels[-2] * v for v in voxels], "--", alpha=0.5,
                     label="proportional")
        panel.set_xlabel("active voxels")
        panel.set_ylabel(label)
        panel.grid(True, which="both", alpha=0.3)
        panel.legend()
    pyplot.savefig(output, metadata={"Date": None})


if __name__ == "__main__":
    main()
