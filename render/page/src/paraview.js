/**
 * ParaView's presets: written as JSON, and read as JSON and as the XML of older versions
 * (libesvr/render/paraview_preset.cpp).
 * @typedef {import("./types.js").Preset} Preset
 * @typedef {import("./types.js").Transfer} Transfer
 */

const kNanColor = [0.5, 0, 0];

/** The text of a preset file. @param {Transfer} transfer @param {string} name */
export function paraViewText({ space, colors, opacity }, name) {
  const preset = {
    Name: name,
    ColorSpace: space === "HSVWrap" ? "HSV" : space,
    ...(space === "HSVWrap" && { HSVWrap: true }),
    NanColor: kNanColor,
    RGBPoints: colors.flat(),
    Points: opacity.flat(),
  };
  return JSON.stringify([preset], null, 2) + "\n";
}

const kSpaces = new Map([["RGB", "RGB"], ["HSV", "HSV"], ["Lab", "Lab"], ["CIELAB", "Lab"], ["Diverging", "Diverging"], ["Step", "Step"]]);

/** Points in rows of four numbers, by increasing values. @param {unknown} numbers @param {string} name @returns {any[]} */
function rowsOf(numbers, name) {
  const valid = Array.isArray(numbers) && numbers.length > 0 && numbers.length % 4 === 0 && numbers.every(Number.isFinite);
  if (!valid) throw new Error(`${name} is no list of numbers, 4 a point.`);
  const rows = Array.from({ length: numbers.length / 4 }, (_, i) => numbers.slice(4 * i, 4 * i + 4));
  return rows.sort((a, b) => a[0] - b[0]);
}

/** @param {any} preset */
function spaceOf({ ColorSpace = "RGB", HSVWrap }) {
  const space = kSpaces.get(ColorSpace);
  if (!space) throw new Error(`ColorSpace "${ColorSpace}" is none of RGB, HSV, Lab, Diverging, Step.`);
  return space === "HSV" && HSVWrap ? "HSVWrap" : space;
}

/** @param {any} preset @returns {Preset} */
function presetOf(preset) {
  const colors = rowsOf(preset.RGBPoints, "RGBPoints");
  const linear = [colors[0][0], 0, 0.5, 0, colors.at(-1)[0], 1, 0.5, 0];
  const opacity = rowsOf(preset.Points ?? linear, "Points");
  return { name: String(preset.Name ?? ""), transfer: { space: spaceOf(preset), colors, opacity } };
}

/** A map of ParaView's XML in the form of the JSON. @param {Element} map */
function presetOfXml(map) {
  const number = (/** @type {Element} */ element, /** @type {string} */ name) => Number(element.getAttribute(name));
  const points = [...map.querySelectorAll("Point")];
  const opaque = points.every((p) => number(p, "o") === 1);
  return {
    Name: map.getAttribute("name"),
    ColorSpace: map.getAttribute("space") ?? "RGB",
    RGBPoints: points.flatMap((p) => ["x", "r", "g", "b"].map((name) => number(p, name))),
    Points: opaque ? undefined : points.flatMap((p) => [number(p, "x"), number(p, "o"), 0.5, 0]),
  };
}

/** @param {string} text */
function parsed(text) {
  if (!text.trimStart().startsWith("<")) {
    const content = JSON.parse(text);
    return Array.isArray(content) ? content : [content];
  }
  const xml = new DOMParser().parseFromString(text, "text/xml");
  return [...xml.querySelectorAll("ColorMap")].map(presetOfXml);
}

/** The presets of a file that have colors. @param {string} text @returns {Preset[]} */
export function presetsOf(text) {
  const presets = parsed(text).filter((preset) => preset?.RGBPoints);
  if (presets.length === 0) throw new Error("There is no preset with RGBPoints.");
  return presets.map(presetOf);
}
