"""What Jupyter shows of a volume or a grid: a small picture and a table."""
import base64
import html
import struct
import zlib

SIDE = 160  # pixels


def png(pixels):
    """The bytes of a PNG file. `pixels` is uint8 of shape (height, width, 4)."""
    height, width, _ = pixels.shape
    rows = b"".join(b"\0" + pixels[y].tobytes() for y in range(height))

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = struct.pack(">IIBBBBB", width, height, 8, 6, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


def picture(drawn):
    """The picture of something with a box, which may have no active voxel."""
    if drawn.box is None or drawn.active_voxels == 0:
        return ""
    data = base64.b64encode(png(drawn.render(SIDE, SIDE, background=(0, 0, 0)))).decode()
    return f'<img alt="A picture of {html.escape(drawn.name)}" width="{SIDE}" src="data:image/png;base64,{data}">'


def table(drawn, rows):
    cells = "".join(f"<tr><th style='text-align:left'>{name}</th><td style='text-align:left'>"
                    f"{html.escape(str(value))}</td></tr>" for name, value in rows)
    return (f"<div style='display:flex;gap:1em;align-items:center'>{picture(drawn)}"
            f"<table><caption>{html.escape(drawn.name)}</caption>{cells}</table></div>")


def box_text(box):
    return "none" if box is None else f"{tuple(box[0])} to {tuple(box[1])}"


def of_volume(volume):
    return table(volume, [("class", volume.grid_class), ("active voxels", f"{volume.active_voxels:,}"),
                          ("box", box_text(volume.box)), ("background", volume.background)])


def of_grid(grid):
    low, high = grid.value_range
    rows = [("class", grid.grid_class), ("stored as", grid.kind), ("active voxels", f"{grid.active_voxels:,}"),
            ("box", box_text(grid.box)), ("values", f"{low:.6g} to {high:.6g}"), ("bytes", f"{grid.bytes:,}")]
    if grid.ellipsoid_count:
        rows.insert(2, ("ellipsoids", f"{grid.ellipsoid_count:,}"))
    return table(grid, rows)
