"""Splats in other tools: what formats lose of their optical depth, and pictures beside those of the volume (docs/splats.md).

OUT of `bench.py run splats` is a folder in which `npm install @playcanvas/splat-transform @sparkjsdev/spark three
playwright-core` was run. Besides the rows, the case writes OUT/splats_smoke1.png and OUT/splats_aneurism.png.
"""
import json
import pathlib
from functools import partial

from bench import call
from rivals import write_smoke_preset

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


def make(bench, scene):
    """The file of ellipsoids and that of splats."""
    volume, fit, look = SCENES[scene]
    name = scene.replace(", ", "_").replace(" ", "_")
    fitted, splats = bench.out / f"{name}.esvr", bench.out / f"{name}.ply"
    if not fitted.exists():
        bench.run("vdb2esvr", bench.volume(volume), fitted, "--representation", "ellipsoids", *fit)
    bench.run("esvr2vdb", fitted, splats, "--colors", "1,1,1", "--force", *look)
    return fitted, splats


def losses(bench, splats):
    """What the depth of splats loses in each format, in percent."""
    tool = ["node", bench.out / "node_modules/@playcanvas/splat-transform/bin/cli.mjs", "-q", "-w", "-g", "cpu"]
    whole, back = depth_of(splats), bench.out / "back.ply"
    for name, options in FORMATS.items():
        packed = bench.out / f"packed{name.split(',')[0]}"
        call(*tool, splats, *options, packed)
        call(*tool, packed, back)
        yield name, 100 * float(depth_of(back) / whole - 1)


def thin(bench):
    """The splats of a thin smoke1 as esvr2vdb writes them, and those of the usual density made thinner."""
    fitted, splats = make(bench, "smoke1")
    usual = float(header_of(splats)["esvr_density_scale"][0])
    ours, plain = bench.out / "thin.ply", bench.out / "thin_plain.ply"
    bench.run("esvr2vdb", fitted, ours, "--density-scale", usual * THIN, "--force")
    write_thinner(splats, plain, THIN)
    return {"smoke1, a 25th of the density": ours, "the same, opacities not rounded to 255ths": plain}


def write_views(bench, volume, splats, direction):
    """Writes the camera and the transfer function of esvr-render, and the view of the page that sees the same.

    The transfer function is white, and its extinction in proportion to the value.
    """
    import numpy as np
    affine, comments = np.array(volume.transform), header_of(splats)
    voxel = abs(np.linalg.det(affine[:3, :3])) ** (1 / 3)
    to_world = np.array(comments["esvr_to_world"], float).reshape(4, 4)
    box = np.array(volume.box, float)
    middle, side = box.mean(0), (box[1] - box[0] + 1).max()
    eye = middle + np.array(direction) / np.linalg.norm(direction) * side * 2.1
    camera = {"eye": list(eye), "center": list(middle), "up": [0, 1, 0], "fov": FOV}
    (bench.out / "camera.json").write_text(json.dumps(camera))
    back = np.linalg.inv(to_world[:3, :3])
    place = lambda p: list((np.array(p) * voxel + affine[:3, 3] - to_world[3, :3]) @ back)  # noqa: E731
    up = np.array([0, 1, 0]) @ back
    view = {"eye": place(eye), "center": place(middle), "up": list(up / np.linalg.norm(up)), "fov": FOV,
            "url": f"/{splats.name}"}
    (bench.out / "view.json").write_text(json.dumps(view))
    write_smoke_preset(bench.out / "linear.json", volume.value_range[1], float(comments["esvr_density_scale"][0]) * voxel, 1024)


def pictures(bench, scene, direction):
    """The picture of the volume by esvr-render, and that of its splats by Spark."""
    import esvr
    import matplotlib.image
    _, splats = make(bench, scene)
    source = bench.volume(SCENES[scene][0])
    write_views(bench, esvr.Volume.from_vdb(source), splats, direction)
    drawn, spark = bench.out / "volume.png", bench.out / "spark.png"
    bench.run("esvr-render", source, drawn, "--camera", bench.out / "camera.json", "--tf", bench.out / "linear.json", "--range",
              "own", "--background", "0,0,0", "--resolution", f"{SIDE}x{SIDE}", "--step", "0.5", "--force")
    call("node", HERE / "splats/draw.mjs", bench.out, bench.arguments.browser, bench.out / "view.json", spark)
    return [matplotlib.image.imread(path)[..., :3] for path in (drawn, spark)]


def psnr(a, b):
    import numpy as np
    return float(-10 * np.log10(((a.astype(float) - b) ** 2).mean()))


def save(path, volume, splats):
    """The picture of a volume, that of its splats, and ten times their difference."""
    import matplotlib.image
    import numpy as np
    row = np.concatenate([volume, splats, np.clip(10 * np.abs(volume - splats), 0, 1)], 1)
    matplotlib.image.imsave(path, row.reshape(SIDE // 2, 2, row.shape[1] // 2, 2, 3).mean((1, 3)))


def splats(bench):
    """What other formats lose of splats, and pictures of splats beside those of the volume (docs/splats.md)."""
    def scene_row(scene):
        _, path = make(bench, scene)
        made = {view: pictures(bench, scene, direction) for view, direction in VIEWS.items()}
        if scene == SCENES[scene][0]:
            save(bench.out / f"splats_{scene}.png", *made["front"])
        yield {"splats of": scene, "number": len(splats_of(path)[0]), **{view: psnr(*pair) for view, pair in made.items()},
               **dict(losses(bench, path))}

    def thin_rows():
        return [{"splats of": name, **dict(losses(bench, path))} for name, path in thin(bench).items()]

    for scene in SCENES:
        yield (scene,), partial(scene_row, scene)
    yield ("thin",), thin_rows
