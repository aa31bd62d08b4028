// Draws the charts of a page with uPlot, from the JSON that stands in each of them.
import uPlot from "uplot";
import "uplot/dist/uPlot.min.css";

const kColors = 10;       // --curve-1 to --curve-10 in page.css
const kMostMarkers = 40;  // more markers would hide the line
const kLargestHeight = 380;

/** A number with three digits. */
const plain = value => String(Number(value.toPrecision(3)));

function bytes(value) {
  const units = ["B", "KB", "MB", "GB", "TB"];
  let unit = 0;
  for (; value >= 999.5 && unit + 1 < units.length; ++unit) value /= 1000;
  return `${plain(value)} ${units[unit]}`;
}

const texts = {
  none: plain,
  bytes,
  seconds: value => `${plain(value)} s`,
  percent: value => `${plain(value)} %`,
};

/** The PSNR of an error in percent of the peak. */
const decibels = percent => plain(-20 * Math.log10(percent / 100));

const color = name => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();

/** Ours is drawn last, in front of the others. */
const inOrder = series => [...series.filter(s => !s.ours), ...series.filter(s => s.ours)];

/** All points by increasing x, as rows of uPlot: each of them belongs to one series. */
function columnsOf(series) {
  const points = series.flatMap((s, i) => s.points.map(([x, y, note]) => ({ x, y, note, i })));
  points.sort((a, b) => a.x - b.x);
  const ys = series.map((_, i) => points.map(point => (point.i === i ? point.y : null)));
  return { data: [points.map(point => point.x), ...ys], notes: points.map(point => point.note) };
}

/** The index of the value of a column that is nearest to an index; null if the column is empty. */
function nearest(column, index) {
  for (let d = 0; d < column.length; ++d)
    for (const i of [index - d, index + d]) if (column[i] != null) return i;
  return null;
}

function axis(label, text, more) {
  return {
    label,
    stroke: () => color("faint"),
    grid: { stroke: () => color("line"), width: 1 },
    ticks: { show: false },
    values: (_, splits) => splits.map(value => (value === null ? "" : text(value))),
    ...more,
  };
}

function axesOf(chart) {
  const { x, y } = chart;
  const axes = [axis(x.label, texts[x.unit]), axis(y.label, texts[y.unit], { size: 70 })];
  if (y.decibels)
    axes.push(axis("PSNR, dB", decibels, { side: 1, scale: "y", size: 50, grid: { show: false } }));
  return axes;
}

/** What the legend says about the point of a series that is nearest to the pointer. */
function readout(chart, notes) {
  return (u, value, _, index) => {
    if (value == null || index == null) return "";
    const said = [texts[chart.x.unit](u.data[0][index]), texts[chart.y.unit](value)];
    if (notes[index]) said.push(...notes[index].split("\n"));
    return said.join(", ");
  };
}

function seriesOf(chart, series, notes) {
  return [{ label: chart.x.label, value: () => "" }, ...series.map(s => ({
    label: s.name,
    stroke: () => color(`curve-${s.number % kColors + 1}`),
    width: s.ours ? 3 : 1.5,
    paths: s.joined ? undefined : () => null,
    spanGaps: true,
    points: { show: !s.joined || s.points.length <= kMostMarkers, size: s.ours ? 9 : 6 },
    value: readout(chart, notes),
  }))];
}

function draw(figure) {
  const chart = JSON.parse(figure.querySelector("script").textContent);
  chart.series.forEach((s, number) => { s.number = number; });
  const series = inOrder(chart.series), { data, notes } = columnsOf(series);
  const place = figure.querySelector(".drawing");
  const size = () => ({ width: place.clientWidth, height: Math.min(kLargestHeight, place.clientWidth * 0.8) });
  const scale = ({ logarithmic }) => ({ time: false, distr: logarithmic ? 3 : 1 });
  const plot = new uPlot({
    ...size(),
    scales: { x: scale(chart.x), y: scale(chart.y) },
    axes: axesOf(chart),
    series: seriesOf(chart, series, notes),
    cursor: { dataIdx: (u, s, index) => (s === 0 ? index : nearest(u.data[s], index)) },
  }, data, place);
  new ResizeObserver(() => plot.setSize(size())).observe(place);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => plot.redraw());
}

for (const figure of document.querySelectorAll(".chart")) draw(figure);
