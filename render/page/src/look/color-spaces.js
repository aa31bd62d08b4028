/**
 * Mixes colors as the library does (libesvr/render/transfer_function.cpp), so that the editor shows the
 * colors of the picture.
 * @typedef {import("../types.js").Triple} Triple
 */

/** @param {number} v */
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
