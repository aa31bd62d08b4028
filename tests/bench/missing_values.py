#!/usr/bin/env python3
"""missing_values.py BUILD FILE.vdb: what NaN voxels cost with --nonfinite keep --max-error 1% (docs/convert.md).

Voxels of the first grid become NaN in a ball or at random. Prints the bytes of their places, and of the rest of the file.
"""
import json
import pathlib
import subprocess
import sys
import tempfile

import numpy as np


def main():
    build, path = map(pathlib.Path, sys.argv[1:])
    sys.path.insert(0, str(build / "python"))
    import esvr
    source = esvr.Volume.from_vdb(path)
    values = source.to_numpy()
    active = np.argwhere(values != source.background)
    far = np.linalg.norm(active - np.array(values.shape) / 2, axis=1)
    order = np.random.default_rng(1).permutation(len(active))
    with tempfile.TemporaryDirectory() as folder:
        made, report = pathlib.Path(folder, "made.vdb"), pathlib.Path(folder, "report.json")
        for name, ranks in (("ball", np.argsort(far, kind="stable")), ("random", order)):
            for share in (0.0, 0.01, 0.2):
                gaps = values.copy()
                gaps[tuple(active[ranks[:int(share * len(active))]].T)] = np.nan
                esvr.Volume.from_numpy(gaps, background=source.background, nonfinite="keep").save(made, overwrite=True)
                subprocess.run([build / "vdb2esvr/vdb2esvr", made, pathlib.Path(folder, "made.esvr"), "-f", "-q", "--nonfinite",
                                "keep", "--max-error", "1%", "--report", report], check=True)
                grid = json.loads(report.read_text())["grids"][0]
                kept = grid["source"]["nonfinite_kept"] or {"nan": 0, "bytes": 0}
                print(f"| {kept['nan']:,} {name} ({share:.0%}) | {kept['bytes']:,} | {grid['bytes'] - kept['bytes']:,} |")


main()
