/**
 * The scene: what it begins with, its form in the address of the page, and the store that holds and undoes it.
 * @typedef {import("./types.js").Description} Description
 * @typedef {import("./types.js").Grid} Grid
 * @typedef {import("./types.js").Scene} Scene
 * @typedef {import("./types.js").Triple} Triple
 * @typedef {(value: any) => boolean} Check
 */

/** The longest side of a picture, which esvr-view allows too. */
export const kMostPixels = 4096;

/** The members whose defaults do not depend on the volume. They are those of esvr-render. */
export const kDefaults = Object.freeze({
  opacityLength: 1,
  step: 1,
  mode: /** @type {const} */ ("composite"),
  classification: /** @type {const} */ ("pre"),
  shade: false,
  lod: /** @type {const} */ ("auto"),
  between: /** @type {const} */ ("voxels"),
  background: null,
  clip: null,
  slice: null,
  compare: null,
});

/** @param {Description} description @param {{file: number, grid: number}} place */
export const gridOf = (description, { file, grid }) => description.files[file].grids[grid];

/** @param {Description} description @param {number} file @param {number} grid */
export function startOf(description, file, grid) {
  const { space, colors, opacity } = gridOf(description, { file, grid }).defaultLook;
  const frame = description.files[file].frames[0] ?? null;
  return { ...kDefaults, file, grid, frame, transfer: { space, colors, opacity } };
}

/**
 * Corners of what is drawn: up to one voxel outside the outermost voxels, because values are
 * interpolated up to there.
 * @param {Grid} grid @returns {[Triple, Triple]}
 */
export function edgesOf({ box: [low, high] }) {
  const moved = (/** @type {Triple} */ corner, /** @type {number} */ by) =>
    /** @type {Triple} */ (corner.map((v) => v + by));
  return [moved(low, -1), moved(high, 1)];
}

// Which values the members of a scene may have. Links can be cut off, or be written by hand.

const isFinite = (/** @type {any} */ v) => Number.isFinite(v);
/** @param {number} count @returns {Check} */
const numbers = (count) => (v) => Array.isArray(v) && v.length === count && v.every(isFinite);
/** @param {any[]} values @returns {Check} */
const oneOf = (...values) => (v) => values.includes(v);
/** @param {Check} check @returns {Check} */
const orNull = (check) => (v) => v === null || check(v);
/** @param {Record<string, Check>} checks @returns {Check} */
const object = (checks) => (v) => typeof v === "object" && v !== null && Object.keys(checks).every((name) => checks[name](v[name]));
/** @type {Check} */
const isPositive = (v) => isFinite(v) && v > 0;
/** @type {Check} */
const isIndex = (v) => Number.isInteger(v) && v >= 0;
/** @type {Check} */
const isBoolean = (v) => typeof v === "boolean";
/** @type {Check} */
const isTriple = numbers(3);
/** @type {Check} */
const isShare = (v) => isFinite(v) && v >= 0 && v <= 1;

/** Points whose values do not decrease, each with further members between 0 and 1. @type {Check} */
const isCurve = (v) =>
  Array.isArray(v) && v.length > 0 && v.every(numbers(4)) &&
  v.every((p, i) => p.slice(1).every(isShare) && (i === 0 || v[i - 1][0] <= p[0]));

/** @type {Check} */
const isCamera = (v) =>
  object({ eye: isTriple, center: isTriple, up: isTriple })(v) &&
  (isPositive(v.height) || (isPositive(v.fov) && v.fov < 180)) && String(v.eye) !== String(v.center);

/** @type {Record<string, Check>} */
const kChecks = {
  frame: orNull(Number.isInteger),
  camera: isCamera,
  transfer: object({ space: oneOf("RGB", "HSV", "HSVWrap", "Lab", "Diverging", "Step"), colors: isCurve, opacity: isCurve }),
  opacityLength: isPositive,
  step: isPositive,
  mode: oneOf("composite", "maximum", "average"),
  classification: oneOf("pre", "post"),
  shade: isBoolean,
  lod: oneOf("auto", "off"),
  between: oneOf("voxels", "sum"),
  background: orNull((v) => isTriple(v) && v.every(isShare)),
  clip: orNull((v) => Array.isArray(v) && v.length === 2 && v.every(isTriple)),
  slice: orNull(object({ axis: oneOf("x", "y", "z"), place: isFinite })),
  compare: orNull(object({
    file: isIndex, grid: isIndex, frame: orNull(Number.isInteger),
    show: oneOf("split", "reference", "difference"), split: isShare, gain: isFinite,
  })),
};

// The scene as the part of the address behind '#', so that a link reproduces the view. Members that
// have their usual value are left out.

/** @param {Scene} scene @param {Description} description */
export function hashOf(scene, description) {
  const usual = /** @type {Record<string, unknown>} */ (startOf(description, scene.file, scene.grid));
  const members = new URLSearchParams();
  for (const [name, value] of Object.entries(scene)) {
    const text = JSON.stringify(value);
    if (name === "file" || name === "grid" || text !== JSON.stringify(usual[name])) members.set(name, text);
  }
  return "#" + members.toString();
}

/** @param {string | null} text */
function parsed(text) {
  try {
    return text === null ? undefined : JSON.parse(text);
  } catch {
    return undefined; // an address that was cut off or typed wrongly: the usual value
  }
}

/** @param {unknown} value @param {number} count */
function indexBelow(value, count) {
  return Number.isInteger(value) && Number(value) >= 0 && Number(value) < count ? Number(value) : 0;
}

/**
 * The scene of an address. Its camera is missing if the address has none.
 * @param {string} hash @param {Description} description
 * @returns {Omit<Scene, "camera"> & {camera?: Scene["camera"]}}
 */
export function sceneOf(hash, description) {
  const members = new URLSearchParams(hash.slice(1));
  const file = indexBelow(parsed(members.get("file")), description.files.length);
  const grid = indexBelow(parsed(members.get("grid")), description.files[file].grids.length);
  const scene = /** @type {Record<string, any>} */ (startOf(description, file, grid));
  for (const [name, isGood] of Object.entries(kChecks)) {
    const value = parsed(members.get(name));
    if (value !== undefined && isGood(value)) scene[name] = value;
  }
  const { frame, compare } = scene, { frames } = description.files[file];
  if (!frames.includes(frame)) scene.frame = frames[0] ?? null;
  if (compare && !description.files[compare.file]?.grids[compare.grid]) scene.compare = null;
  if (scene.clip && scene.slice) scene.slice = null; // a scene has one of them
  return /** @type {any} */ (scene);
}

/** A scene that did not change for so long is drawn completely. */
const kRestMs = 180;
const kMostUndone = 200;

/** Holds the scene, tells the page when it changes, and takes changes back. */
export class Store {
  /** @type {Scene} */
  scene;
  /** The user is changing something right now. */
  moving = false;
  /** @type {(() => void)[]} */
  #listeners = [];
  #timer = 0;
  /** Earlier and later scenes; the camera is left alone. @type {Scene[]} */
  #past = [];
  /** @type {Scene[]} */
  #future = [];
  /** The scene when the present change began. @type {Scene | null} */
  #before = null;

  /** @param {Scene} scene */
  constructor(scene) {
    this.scene = scene;
  }

  /** @param {() => void} listener  called after each change, and when the scene comes to rest */
  subscribe(listener) {
    this.#listeners.push(listener);
  }

  /** @param {Partial<Scene>} change @param {{moving?: boolean}} [how]  moving: further changes follow */
  set(change, { moving = false } = {}) {
    this.#before ??= this.scene;
    this.scene = { ...this.scene, ...change };
    this.moving = moving;
    clearTimeout(this.#timer);
    if (moving) this.#timer = window.setTimeout(() => this.#rest(), kRestMs);
    else this.#remember();
    this.#tell();
  }

  get canUndo() {
    return this.#past.length > 0;
  }
  get canRedo() {
    return this.#future.length > 0;
  }
  undo() {
    this.#exchange(this.#past, this.#future);
  }
  redo() {
    this.#exchange(this.#future, this.#past);
  }

  #rest() {
    this.moving = false;
    this.#remember();
    this.#tell();
  }

  /** Ends a change that can be taken back. */
  #remember() {
    const before = this.#before;
    this.#before = null;
    if (!before || sameSettings(before, this.scene)) return;
    this.#past.push(before);
    if (this.#past.length > kMostUndone) this.#past.shift();
    this.#future = [];
  }

  /** @param {Scene[]} from @param {Scene[]} to */
  #exchange(from, to) {
    const scene = from.pop();
    if (!scene) return;
    to.push(this.scene);
    const sameVolume = scene.file === this.scene.file && scene.grid === this.scene.grid;
    this.scene = sameVolume ? { ...scene, camera: this.scene.camera } : scene;
    this.#tell();
  }

  #tell() {
    for (const listener of this.#listeners) listener();
  }
}

/** Moving the camera and choosing a frame is no change of settings. @param {Scene} scene */
const settingsOf = ({ camera, frame, compare, ...rest }) =>
  JSON.stringify({ ...rest, compare: compare && { ...compare, frame: null, split: 0 } });

/** @param {Scene} a @param {Scene} b */
const sameSettings = (a, b) => settingsOf(a) === settingsOf(b);
