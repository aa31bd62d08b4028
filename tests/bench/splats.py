#!/usr/bin/env python3
"""Splats in other tools: what formats lose of their optical depth, and pictures beside those of the volume.

    splats.py --bin FOLDER --data FOLDER --out FOLDER --browser PROGRAM

OUT is a folder in which `npm install @playcanvas/splat-transform @sparkjsdev/spark three playwright-core` was run. FOLDER
of --bin is a build folder with the Python module; python3-numpy and python3-matplotlib are needed. The script prints the
tables of docs/splats.md and writes OUT/splats_smoke1.png and OUT/splats_aneurism.png.
"""
import argparse
import json
import pathlib
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent
# A fit, its volume, and the options of vdb2esvr and esvr2vdb.
SCENES = {
    "smoke1": ("smoke1", ["--tone", "off"], []),
    "smoke1, tone curve": ("smoke1", [], []),
    "aneurism": ("aneurism", [], []),
    "aneurism, a quarter of the density": ("aneurism", [], ["--density-scale", "0.14"]),
}
THIN = 0.04  # of the usual density: a fog that formats of eight bits hardly keep
VIEWS = {"front": (0.35, 0.25, 1.0), "side": (1.0, 0.1, -0.2)}
FORMATS = {".sog": [], ".compressed.ply": [], ".spz, version 3": ["--spz-version", "3"], ".spz, version 4": ["--spz-version", "4"]}
FOV = 30
SIDE = 512  # pixels, as in splats/page.html


def run(*words, **options):
    subprocess.run([str(word) for word in words], check=True, stdout=subprocess.DEVNULL, **options)


def header_of(path):
    text = path.read_bytes().partition(b"end_header\n")[0].decode()
    return {words[1]: words[2:] for words in map(str.split, text.splitlines()) if words[0] == "comment"}


def splats_of(path):
    """The alphas and the sizes of splats in a file."""
    import numpy as np
    header, _, rows = path.read_bytes().partition(b"end_header\n")
    words = [line.split() for line in header.decode().splitlines()]
    names = [line[2] for line in words if line[0] == "property"]
    table = np.frombuffer(rows, "<f4").reshape(-1, len(names)).astype(float)
    column = {name: table[:, i] for i, name in enumerate(names)}
    return 1 / (1 + np.exp(-column["opacity"])), np.exp(np.stack([column[f"scale_{a}"] for a in range(3)], 1))


def depth_of(path):
    """The optical depth of all splats over a picture, averaged over all directions."""
    import numpy as np
    alpha, size = splats_of(path)
    depth, power = np.zeros_like(alpha), alpha.copy()
    for n in range(1, 200):  # the dilogarithm
        depth, power = depth + power / n ** 2, power * alpha
    shadow, (nodes, weights) = np.zeros_like(alpha), np.polynomial.legendre.leggauss(32)
    for z, weight in zip(nodes[16:], weights[16:]):
        for turn in (np.arange(16) + 0.5) / 16 * np.pi / 2:
            x, y = np.sqrt(1 - z * z) * np.cos(turn), np.sqrt(1 - z * z) * np.sin(turn)
            a, b, c = size.T
            shadow += weight / 16 * np.sqrt((b * c * x) ** 2 + (a * c * y) ** 2 + (a * b * z) ** 2)
    return (depth * shadow).sum()


def write_thinner(path, out, factor):
    """Writes splats whose depths through their centers are multiplied by a factor, with opacities that no rule rounds."""
    import numpy as np
    header, end, rows = path.read_bytes().partition(b"end_header\n")
    names = [line.split()[2] for line in header.decode().splitlines() if line.startswith("property")]
    table = np.frombuffer(rows, "<f4").reshape(-1, len(names)).copy()
    opacity = table[:, names.index("opacity")].astype(float)
    alpha = -np.expm1(-factor * np.log1p(np.exp(opacity)))
    table[:, names.index("opacity")] = np.log(alpha) - np.log1p(-alpha)
    out.write_bytes(header + end + table.tobytes())


class Bench:
    def __init__(self, arguments):
        self.bin, self.data, self.out = (p.resolve() for p in (arguments.bin, arguments.data, arguments.out))
        self.browser = arguments.browser
        sys.path.insert(0, str(self.bin / "python"))

    def program(self, name, *words):
        folder = {"esvr-render": "render"}.get(name, name)
        run(self.bin / folder / name, *words)

    def make(self, scene):
        """The file of ellipsoids and that of splats."""
        volume, fit, look = SCENES[scene]
        name = scene.replace(", ", "_").replace(" ", "_")
        fitted, splats = self.out / f"{name}.esvr", self.out / f"{name}.ply"
        if not fitted.exists():
            self.program("vdb2esvr", self.data / f"{volume}.vdb", fitted, "--representation", "ellipsoids", *fit)
        self.program("esvr2vdb", fitted, splats, "--colors", "1,1,1", "--force", *look)
        return fitted, splats

    def losses(self, splats):
        """What the depth of splats loses in each format, in percent."""
        tool = ["node", self.out / "node_modules/@playcanvas/splat-transform/bin/cli.mjs", "-q", "-w", "-g", "cpu"]
        whole, back = depth_of(splats), self.out / "back.ply"
        for name, options in FORMATS.items():
            packed = self.out / f"packed{name.split(',')[0]}"
            run(*tool, splats, *options, packed)
            run(*tool, packed, back)
            yield 100 * (depth_of(back) / whole - 1)

    def thin(self):
        """The splats of a thin smoke1 as esvr2vdb writes them, and those of the usual density made thinner."""
        fitted, splats = self.make("smoke1")
        usual = float(header_of(splats)["esvr_density_scale"][0])
        ours, plain = self.out / "thin.ply", self.out / "thin_plain.ply"
        self.program("esvr2vdb", fitted, ours, "--density-scale", usual * THIN, "--force")
        write_thinner(splats, plain, THIN)
        return {"smoke1, a 25th of the density": ours, "the same, opacities not rounded to 255ths": plain}

    def camera(self, volume, splats, direction):
        """Writes the camera of esvr-render and that of the page, which see the same."""
        import numpy as np
        affine, comments = np.array(volume.transform), header_of(splats)
        voxel = abs(np.linalg.det(affine[:3, :3])) ** (1 / 3)
        to_world = np.array(comments["esvr_to_world"], float).reshape(4, 4)
        box = np.array(volume.box, float)
        middle, side = box.mean(0), (box[1] - box[0] + 1).max()
        eye = middle + np.array(direction) / np.linalg.norm(direction) * side * 2.1
        camera = {"eye": list(eye), "center": list(middle), "up": [0, 1, 0], "fov": FOV}
        (self.out / "camera.json").write_text(json.dumps(camera))
        back = np.linalg.inv(to_world[:3, :3])
        place = lambda p: list((np.array(p) * voxel + affine[:3, 3] - to_world[3, :3]) @ back)
        up = np.array([0, 1, 0]) @ back
        view = {"eye": place(eye), "center": place(middle), "up": list(up / np.linalg.norm(up)), "fov": FOV,
                "url": f"/{splats.name}"}
        (self.out / "view.json").write_text(json.dumps(view))
        self.transfer(volume.value_range[1], float(comments["esvr_density_scale"][0]) * voxel)

    def transfer(self, highest, extinction):
        """Writes a white transfer function whose extinction is in proportion to the value."""
        import numpy as np
        points = [[x, -np.expm1(-extinction * x), 0.5, 0] for x in np.linspace(0, highest, 1025)]
        (self.out / "linear.json").write_text(json.dumps(
            [{"Name": "linear", "ColorSpace": "RGB", "RGBPoints": [0, 1, 1, 1, highest, 1, 1, 1],
              "Points": [float(number) for point in points for number in point]}]))

    def pictures(self, scene, direction):
        """The picture of the volume by esvr-render, and that of its splats by Spark."""
        import esvr
        import matplotlib.image
        _, splats = self.make(scene)
        source = self.data / f"{SCENES[scene][0]}.vdb"
        self.camera(esvr.Volume.from_vdb(source), splats, direction)
        drawn, shown = self.out / "volume.png", self.out / "spark.png"
        self.program("esvr-render", source, drawn, "--camera", self.out / "camera.json", "--tf", self.out / "linear.json",
                     "--range", "own", "--background", "0,0,0", "--resolution", f"{SIDE}x{SIDE}", "--step", "0.5", "--force")
        run("node", HERE / "splats/draw.mjs", self.out, self.browser, self.out / "view.json", shown)
        return [matplotlib.image.imread(path)[..., :3] for path in (drawn, shown)]


def psnr(a, b):
    import numpy as np
    return -10 * np.log10(((a.astype(float) - b) ** 2).mean())


def save(bench, name, pictures):
    """The picture of a volume, that of its splats, and ten times their difference."""
    import matplotlib.image
    import numpy as np
    volume, splats = pictures
    row = np.concatenate([volume, splats, np.clip(10 * np.abs(volume - splats), 0, 1)], 1)
    half = row.reshape(SIDE // 2, 2, row.shape[1] // 2, 2, 3).mean((1, 3))
    matplotlib.image.imsave(bench.out / f"splats_{name}.png", half)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    for name in ("bin", "data", "out"):
        parser.add_argument(f"--{name}", type=pathlib.Path, required=True)
    parser.add_argument("--browser", default="/usr/bin/chromium")
    bench = Bench(parser.parse_args())
    print("| splats of |", " | ".join(FORMATS), "|")
    for scene in SCENES:
        _, splats = bench.make(scene)
        print(f"| {scene} |", " | ".join(f"{loss:+.2f} %" for loss in bench.losses(splats)), "|", flush=True)
    for name, splats in bench.thin().items():
        print(f"| {name} |", " | ".join(f"{loss:+.2f} %" for loss in bench.losses(splats)), "|", flush=True)
    print("| splats of | number |", " | ".join(VIEWS), "|")
    for scene, (volume, *_) in SCENES.items():
        made = {view: bench.pictures(scene, direction) for view, direction in VIEWS.items()}
        if scene == volume:
            save(bench, volume, made["front"])
        number = len(splats_of(bench.make(scene)[1])[0])
        print(f"| {scene} | {number} |", " | ".join(f"{psnr(*p):.1f} dB" for p in made.values()), "|", flush=True)


main()
