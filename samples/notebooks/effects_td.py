# Smoke for a shot: how small may a simulated frame become, and does it still look the same?
#
#     python3 effects_td.py smoke.vdb
#
# The cells (# %%) run one after the other in Jupyter, Spyder or VS Code. Without an argument, the frame is smoke.vdb.

# %% The frame. repr() says its shape, values and transform; Jupyter shows a picture.
import os
import sys

import esvr

source = sys.argv[1] if len(sys.argv) > 1 else "smoke.vdb"
smoke = esvr.Volume.from_vdb(source)
print(smoke)

# %% What a renderer needs: pictures that are the same for the eye. psnr_t50 is the PSNR of the light that passes through.
small = esvr.fit(smoke, picture_psnr=45, effort=3)
quality = esvr.compare(smoke, small)
print(f"{os.path.getsize(source):,} bytes -> {small.bytes:,} bytes, {quality.psnr_t50:.1f} dB of transmittance")
assert quality.psnr_t50 >= 45

# %% Both from the same camera, side by side.
import numpy as np

look = {"width": 160, "height": 120, "colors": "inferno", "background": (0, 0, 0)}
pictures = np.hstack([smoke.render(**look), small.render(**look)])
difference = np.abs(pictures[:, :160].astype(int) - pictures[:, 160:]).max()
print(f"largest difference of a channel: {difference} of 255")

# %% The file for the farm, and a preview of a tenth of the ellipsoids for the viewport.
esvr.write("shot.esvr", [small], overwrite=True)
file = esvr.read("shot.esvr")
count = file.grids[0].ellipsoid_count
if count:
    file.save("preview.vdb", max_ellipsoids=max(1, count // 10), overwrite=True)
file.save("shot.vdb", overwrite=True)  # for Houdini and Blender
file.save("shot.nvdb", overwrite=True)  # for a renderer on the GPU
print(esvr.list_grids("shot.vdb"), file)

# %% All frames of a shot, on all cores: grids and volumes can be sent to other processes.
from concurrent.futures import ThreadPoolExecutor


def error_of(grid):
    return esvr.compare(smoke, grid).max_error


with ThreadPoolExecutor(2) as pool:  # ProcessPoolExecutor works as well
    print("largest errors:", list(pool.map(error_of, file.grids)))
