"""Draws small line charts side by side as one SVG picture. The picture follows the color scheme of the reader."""
import html
import math

WIDTH, HEIGHT = 300, 190            # of a panel
LEFT, RIGHT, TOP, BOTTOM = 42, 10, 26, 34  # margins of a panel
COLUMNS = 3
STYLE = """\
<style>
text { font: 11px sans-serif; fill: #333 }
.title { font-weight: bold }
.grid { stroke: #ccc; stroke-width: 1 }
.line { fill: none; stroke-width: 1.6 }
@media (prefers-color-scheme: dark) {
  .paper { fill: #16181c } text { fill: #ddd } .grid { stroke: #444 }
}
</style>
"""


class Line:
    """A curve: its name, its points, its color and whether it is dashed. A single point is a dot."""

    def __init__(self, name, points, color, dashed=False):
        self.name, self.points, self.color, self.dashed = name, points, color, dashed


def nice_step(span, count):
    """A step of 1, 2 or 5 times a power of ten that divides a span into about `count` parts."""
    raw = span / count
    power = 10 ** math.floor(math.log10(raw))
    return next(f * power for f in (1, 2, 5, 10) if f * power >= raw)


def linear_ticks(low, high, count=4):
    step = nice_step(max(high - low, 1e-9), count)
    first, last = math.floor(low / step), math.ceil(high / step)
    return [n * step for n in range(first, last + 1)]


def log_ticks(low, high):
    return [10.0 ** n for n in range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)]


class Panel:
    """A chart with a logarithmic x axis. Points whose x is not positive are left out."""

    def __init__(self, title, lines):
        self.title = title
        self.lines = [Line(l.name, [p for p in l.points if p[0] > 0], l.color, l.dashed) for l in lines]
        points = [p for line in self.lines for p in line.points]
        self.x_ticks = log_ticks(min(p[0] for p in points), max(p[0] for p in points))
        self.y_ticks = linear_ticks(min(p[1] for p in points), max(p[1] for p in points))

    def x(self, value):
        low, high = (math.log10(t) for t in (self.x_ticks[0], self.x_ticks[-1]))
        return LEFT + (math.log10(value) - low) / (high - low) * (WIDTH - LEFT - RIGHT)

    def y(self, value):
        low, high = self.y_ticks[0], self.y_ticks[-1]
        return HEIGHT - BOTTOM - (value - low) / (high - low) * (HEIGHT - TOP - BOTTOM)

    def draw(self):
        parts = [f'<text class="title" x="{LEFT}" y="16">{html.escape(self.title)}</text>']
        for tick in self.y_ticks:
            parts.append(f'<path class="grid" d="M{LEFT} {self.y(tick):.1f}H{WIDTH - RIGHT}"/>'
                         f'<text x="{LEFT - 5}" y="{self.y(tick) + 4:.1f}" text-anchor="end">{tick:g}</text>')
        for tick in self.x_ticks:
            parts.append(f'<path class="grid" d="M{self.x(tick):.1f} {TOP}V{HEIGHT - BOTTOM}"/>'
                         f'<text x="{self.x(tick):.1f}" y="{HEIGHT - BOTTOM + 15}" '
                         f'text-anchor="middle">{tick:g}</text>')
        return "\n".join(parts + [self.drawn(line) for line in self.lines if line.points])

    def drawn(self, line):
        if len(line.points) == 1:
            x, y = line.points[0]
            return (f'<circle cx="{self.x(x):.1f}" cy="{self.y(y):.1f}" r="3.5" fill="{line.color}">'
                    f'<title>{html.escape(line.name)}</title></circle>')
        path = " ".join(f"{self.x(x):.1f},{self.y(y):.1f}" for x, y in line.points)
        dashes = ' stroke-dasharray="5 3"' if line.dashed else ""
        return (f'<polyline class="line" stroke="{line.color}"{dashes} points="{path}">'
                f'<title>{html.escape(line.name)}</title></polyline>')


def legend(lines, y):
    parts, x = [], LEFT
    for line in lines:
        dashes = ' stroke-dasharray="5 3"' if line.dashed else ""
        parts.append(f'<path class="line" stroke="{line.color}"{dashes} d="M{x} {y}h24"/>'
                     f'<text x="{x + 30}" y="{y + 4}">{html.escape(line.name)}</text>')
        x += 50 + 7 * len(line.name)
    return "\n".join(parts)


def draw(panels, x_label, y_label):
    """The text of a picture of panels. The legend has the names of all lines, each once."""
    rows = math.ceil(len(panels) / COLUMNS)
    names = {line.name: line for panel in panels for line in panel.lines}
    width, height = WIDTH * min(COLUMNS, len(panels)), HEIGHT * rows + 44
    parts = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" '
             f'width="{width}" height="{height}">', STYLE,
             f'<rect class="paper" width="{width}" height="{height}" fill="#fff"/>']
    for n, panel in enumerate(panels):
        parts.append(f'<g transform="translate({n % COLUMNS * WIDTH} {n // COLUMNS * HEIGHT})">'
                     f'{panel.draw()}</g>')
    parts += [f'<text x="{LEFT}" y="{height - 30}">{html.escape(f"x: {x_label}; y: {y_label}")}</text>',
              legend(names.values(), height - 12), "</svg>"]
    return "\n".join(parts) + "\n"
