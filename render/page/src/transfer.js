/**
 * Transfer functions: evaluated as the library does (esvr/transfer_function.h, libesvr/render/transfer_function.cpp),
 * so that the editor shows the colors of the picture, and edited. No function here changes what it is given.
 * @typedef {import("./types.js").ColorMap} ColorMap
 * @typedef {import("./types.js").ColorPoint} ColorPoint
 * @typedef {import("./types.js").OpacityPoint} OpacityPoint
 * @typedef {import("./types.js").Transfer} Transfer
 * @typedef {import("./types.js").Triple} Triple
 * @typedef {[number, number]} Range
 */

/** Between 0 and 1. @param {number} v */
const unit = (v) => Math.min(1, Math.max(0, v));
/** @param {Triple} c @returns {Triple} */
const clamped = (c) => [unit(c[0]), unit(c[1]), unit(c[2])];
/** @param {Triple} a @param {Triple} b @param {number} s @returns {Triple} */
const line = (a, b, s) => [(1 - s) * a[0] + s * b[0], (1 - s) * a[1] + s * b[1], (1 - s) * a[2] + s * b[2]];

// Hue, saturation, value.

/** @param {Triple} c @param {number} high @param {number} range */
function hueOf([r, g, b], high, range) {
  if (range === 0) return 0;
  const sixth = high === r ? (g - b) / range : high === g ? 2 + (b - r) / range : 4 + (r - g) / range;
  return sixth < 0 ? sixth / 6 + 1 : sixth / 6;
}

/** @param {Triple} c @returns {Triple} */
function toHsv(c) {
  const high = Math.max(...c), range = high - Math.min(...c);
  return [hueOf(c, high, range), high === 0 ? 0 : range / high, high];
}

/** @param {Triple} hsv @param {number} n  5 red, 3 green, 1 blue */
function channel(hsv, n) {
  const k = (n + 6 * hsv[0]) % 6;
  return hsv[2] - hsv[2] * hsv[1] * unit(Math.min(k, 4 - k));
}

/** @param {Triple} from @param {Triple} to @param {number} s @param {boolean} wrap */
function mixedHsv(from, to, s, wrap) {
  const a = toHsv(from), b = toHsv(to);
  if (wrap && Math.abs(a[0] - b[0]) > 0.5) (a[0] > b[0] ? a : b)[0] -= 1;
  const hsv = line(a, b, s);
  if (hsv[0] < 0) hsv[0] += 1;
  return clamped([channel(hsv, 5), channel(hsv, 3), channel(hsv, 1)]);
}

// CIE L*a*b* through XYZ with the primaries of sRGB and the white point D65.

/** @type {Triple} */
const kWhite = [0.9505, 1, 1.089];
const kLabLimit = 6 / 29;
/** @param {number} v */
const linearised = (v) => (v > 0.04045 ? ((v + 0.055) / 1.055) ** 2.4 : v / 12.92);
/** @param {number} v */
const gammaCoded = (v) => (v > 0.0031308 ? 1.055 * v ** (1 / 2.4) - 0.055 : 12.92 * v);
/** @param {number} t */
const labCurve = (t) => (t > kLabLimit ** 3 ? Math.cbrt(t) : t / (3 * kLabLimit ** 2) + 4 / 29);
/** @param {number} t */
const labInverse = (t) => (t > kLabLimit ? t ** 3 : 3 * kLabLimit ** 2 * (t - 4 / 29));

/** @param {Triple} c @returns {Triple} */
function toLab(c) {
  const [r, g, b] = c.map(linearised);
  const x = labCurve((0.4124 * r + 0.3576 * g + 0.1805 * b) / kWhite[0]);
  const y = labCurve((0.2126 * r + 0.7152 * g + 0.0722 * b) / kWhite[1]);
  const z = labCurve((0.0193 * r + 0.1192 * g + 0.9505 * b) / kWhite[2]);
  return [116 * y - 16, 500 * (x - y), 200 * (y - z)];
}

/** @param {Triple} lab @returns {Triple} */
function fromLab(lab) {
  const fy = (lab[0] + 16) / 116;
  const x = kWhite[0] * labInverse(fy + lab[1] / 500);
  const y = kWhite[1] * labInverse(fy);
  const z = kWhite[2] * labInverse(fy - lab[2] / 200);
  return clamped([
    gammaCoded(3.2406 * x - 1.5372 * y - 0.4986 * z),
    gammaCoded(-0.9689 * x + 1.8758 * y + 0.0415 * z),
    gammaCoded(0.0557 * x - 0.204 * y + 1.057 * z),
  ]);
}

// Moreland's color space Msh, the polar form of L*a*b*: magnitude, and angles of saturation and hue.

const kUnsaturated = 0.05; // radians
const kWhiteMagnitude = 88;

/** @param {Triple} c @returns {Triple} */
function toMsh(c) {
  const lab = toLab(c), m = Math.hypot(...lab);
  const s = m > 0.001 ? Math.acos(Math.min(lab[0] / m, 1)) : 0;
  return [m, s, s > 0.001 ? Math.atan2(lab[2], lab[1]) : 0];
}

/** @param {Triple} msh */
function fromMsh([m, s, h]) {
  const chroma = m * Math.sin(s);
  return fromLab([m * Math.cos(s), chroma * Math.cos(h), chroma * Math.sin(h)]);
}

/** @param {number} a @param {number} b */
function angleBetween(a, b) {
  const d = Math.abs(a - b);
  return Math.min(d, 2 * Math.PI - d);
}

/**
 * The hue for a grey of magnitude m at the end of an interpolation from a saturated color.
 * @param {Triple} saturated @param {number} m
 */
function fadedHue([magnitude, s, h], m) {
  if (magnitude >= m - 0.1) return h;
  const turn = (s * Math.sqrt(m * m - magnitude * magnitude)) / (magnitude * Math.sin(s));
  return h > -0.3 * Math.PI ? h + turn : h - turn;
}

/** @param {Triple} from @param {Triple} to @param {number} s */
function mixedDiverging(from, to, s) {
  let a = toMsh(from), b = toMsh(to);
  const saturated = (/** @type {Triple} */ msh) => msh[1] > kUnsaturated;
  if (saturated(a) && saturated(b) && angleBetween(a[2], b[2]) > Math.PI / 3) {
    /** @type {Triple} */
    const white = [Math.max(a[0], b[0], kWhiteMagnitude), 0, 0];
    if (s < 0.5) b = white;
    else a = white;
    s = s < 0.5 ? 2 * s : 2 * s - 1;
  }
  if (!saturated(a) && saturated(b)) a[2] = fadedHue(b, a[0]);
  if (!saturated(b) && saturated(a)) b[2] = fadedHue(a, b[0]);
  return fromMsh(line(a, b, s));
}

/**
 * The color between two colors.
 * @param {string} space @param {Triple} a @param {Triple} b @param {number} s  0 to 1
 * @returns {Triple}
 */
export function mixed(space, a, b, s) {
  if (space === "RGB") return clamped(line(a, b, s));
  if (space === "HSV") return mixedHsv(a, b, s, false);
  if (space === "HSVWrap") return mixedHsv(a, b, s, true);
  if (space === "Lab") return fromLab(line(toLab(a), toLab(b), s));
  if (space === "Diverging") return mixedDiverging(a, b, s);
  return b; // Step: the color of the upper point
}

// VTK interpolates linearly below the first sharpness and makes a step above the second one.
const kStraight = 0.01, kStepped = 0.99;

/**
 * Index of the first point whose value is larger.
 * @param {readonly number[][]} points @param {number} x
 */
function nextIndex(points, x) {
  const index = points.findIndex((p) => x < p[0]);
  return index < 0 ? points.length : index;
}

/** @param {number[]} a @param {number[]} b @param {number} x */
const fraction = (a, b, x) => (x - a[0]) / (b[0] - a[0]);

/** @param {{space: string, colors: ColorPoint[]}} look @param {number} x @returns {Triple} */
export function colorAt({ space, colors }, x) {
  const next = nextIndex(colors, x);
  const last = colors[Math.max(0, next - 1)];
  const [, ...color] = last;
  if (next === 0 || next === colors.length || x === last[0]) return color;
  const [, ...after] = colors[next];
  return mixed(space, color, after, fraction(last, colors[next], x));
}

/** @param {number} s @param {number} midpoint */
function bentAtMidpoint(s, midpoint) {
  if (s < midpoint) return (0.5 * s) / midpoint;
  return midpoint < 1 ? 0.5 + (0.5 * (s - midpoint)) / (1 - midpoint) : 1;
}

/** @param {number} s @param {number} sharpness @param {number} y1 @param {number} y2 */
function sharpened(s, sharpness, y1, y2) {
  const power = 1 + 10 * sharpness;
  s = s < 0.5 ? 0.5 * (2 * s) ** power : 1 - 0.5 * (2 * (1 - s)) ** power;
  const s2 = s * s, s3 = s2 * s, tangent = (1 - sharpness) * (y2 - y1);
  const y = (2 * s3 - 3 * s2 + 1) * y1 + (3 * s2 - 2 * s3) * y2 + (s3 - 2 * s2 + s) * tangent + (s3 - s2) * tangent;
  return Math.min(Math.max(y, Math.min(y1, y2)), Math.max(y1, y2));
}

/** @param {OpacityPoint} a @param {OpacityPoint} b @param {number} x */
function opacityBetween(a, b, x) {
  const [, from, midpoint, sharpness] = a, to = b[1];
  const s = bentAtMidpoint(fraction(a, b, x), midpoint);
  if (sharpness > kStepped) return s < 0.5 ? from : to;
  if (sharpness < kStraight) return (1 - s) * from + s * to;
  return sharpened(s, sharpness, from, to);
}

/** @param {OpacityPoint[]} curve @param {number} x */
export function opacityAt(curve, x) {
  const next = nextIndex(curve, x);
  const last = curve[Math.max(0, next - 1)];
  if (next === 0 || next === curve.length || x === last[0]) return last[1];
  return opacityBetween(last, curve[next], x);
}

/** @param {readonly number[][]} points @returns {Range} */
export const extentOf = (points) => [points[0][0], points[points.length - 1][0]];

/** The values over which a function changes. @param {Transfer} transfer @returns {Range} */
export function rangeOf({ colors, opacity }) {
  const [a, b] = extentOf(colors), [c, d] = extentOf(opacity);
  return [Math.min(a, c), Math.max(b, d)];
}

/**
 * Moves points as the range `from` is stretched to the range `to`.
 * @template {number[]} P
 * @param {P[]} points @param {Range} from @param {Range} to
 * @returns {P[]}
 */
export function stretched(points, from, to) {
  const scale = from[1] > from[0] ? (to[1] - to[0]) / (from[1] - from[0]) : 0;
  return points.map(([x, ...rest]) => /** @type {P} */ ([to[0] + (x - from[0]) * scale, ...rest]));
}

/** @param {Transfer} transfer @param {Range} range @returns {Transfer} */
export function withRange(transfer, range) {
  const from = rangeOf(transfer);
  return {
    ...transfer,
    colors: stretched(transfer.colors, from, range),
    opacity: stretched(transfer.opacity, from, range),
  };
}

/** Puts a color map over the range of the colors. @param {Transfer} transfer @param {ColorMap} map */
export function withColorMap(transfer, { space, points }) {
  const colors = stretched(points, extentOf(points), extentOf(transfer.colors));
  return { ...transfer, space, colors };
}

/** Puts a curve over the range of the opacities. @param {Transfer} transfer @param {OpacityPoint[]} curve */
export function withCurve(transfer, curve) {
  return { ...transfer, opacity: stretched(curve, extentOf(curve), extentOf(transfer.opacity)) };
}

/** Mirrors the colors. @param {Transfer} transfer @returns {Transfer} */
export function withInvertedColors(transfer) {
  const [low, high] = extentOf(transfer.colors);
  const colors = transfer.colors.map(([x, ...c]) => /** @type {ColorPoint} */ ([low + high - x, ...c])).reverse();
  return { ...transfer, colors };
}

/** Replaces the colors by a few that can be edited. @param {Transfer} transfer @param {number} count */
export function withFewerColors(transfer, count) {
  const [low, high] = extentOf(transfer.colors);
  const places = Array.from({ length: count }, (_, i) => low + ((high - low) * i) / (count - 1));
  return { ...transfer, colors: places.map((x) => /** @type {ColorPoint} */ ([x, ...colorAt(transfer, x)])) };
}

/**
 * Changes a point; its value stays between those of its neighbours.
 * @template {number[]} P
 * @param {P[]} points @param {number} index @param {NoInfer<P>} point
 * @returns {P[]}
 */
export function withPoint(points, index, point) {
  const low = points[index - 1]?.[0] ?? -Infinity, high = points[index + 1]?.[0] ?? Infinity;
  const [x, ...rest] = point;
  const kept = /** @type {P} */ ([Math.min(high, Math.max(low, x)), ...rest]);
  return points.map((p, i) => (i === index ? kept : p));
}

/**
 * @template P
 * @param {P[]} points @param {number} index
 * @returns {P[]}
 */
export function withoutPoint(points, index) {
  return points.filter((_, i) => i !== index);
}

/**
 * Adds a point.
 * @template {number[]} P
 * @param {P[]} points @param {NoInfer<P>} point
 * @returns {{points: P[], index: number}}
 */
export function withAddedPoint(points, point) {
  const index = nextIndex(points, point[0]);
  return { points: points.toSpliced(index, 0, point), index };
}

/** The value halfway from a point to the next one, or to the one before. @param {readonly number[][]} points @param {number} index */
export function halfwayFrom(points, index) {
  const other = points[index + 1] ?? points[index - 1] ?? points[index];
  return (points[index][0] + other[0]) / 2;
}

/** @param {number[][]} a @param {number[][]} b */
function samePoints(a, b) {
  const scale = Math.max(...extentOf(b).map(Math.abs), 1e-30);
  const near = (/** @type {number} */ v, /** @type {number} */ w, /** @type {number} */ i) =>
    Math.abs(v - w) <= 1e-9 * (i === 0 ? scale : 1);
  return a.length === b.length && a.every((p, i) => p.every((v, j) => near(v, b[i][j], j)));
}

/**
 * Name of the color map that a function has; "" if it has another one.
 * @param {Transfer} transfer @param {Record<string, ColorMap>} maps
 */
export function colorMapName(transfer, maps) {
  const range = extentOf(transfer.colors);
  const same = (/** @type {ColorMap} */ { space, points }) =>
    space === transfer.space && samePoints(stretched(points, extentOf(points), range), transfer.colors);
  return Object.keys(maps).find((name) => same(maps[name])) ?? "";
}

/**
 * Name of the opacity curve that a function has; "" if it has another one.
 * @param {Transfer} transfer @param {Record<string, OpacityPoint[]>} curves
 */
export function curveName(transfer, curves) {
  const range = extentOf(transfer.opacity);
  const same = (/** @type {OpacityPoint[]} */ curve) =>
    samePoints(stretched(curve, extentOf(curve), range), transfer.opacity);
  return Object.keys(curves).find((name) => same(curves[name])) ?? "";
}
