/**
 * Draws one file without a server: the decoder gives voxels and tables, and WebGL2 draws them. It runs
 * in a worker, or on the page where workers cannot draw.
 * @typedef {import("../types.js").Camera} Camera
 * @typedef {import("../types.js").DrawRequest} DrawRequest
 * @typedef {import("../types.js").Edges} Edges
 * @typedef {import("../types.js").FitRequest} FitRequest
 * @typedef {import("./ray-marcher.js").Frame} Frame
 * @typedef {import("../types.js").Grid} Grid
 * @typedef {import("../types.js").PictureHead} PictureHead
 * @typedef {import("../types.js").Place} Place
 * @typedef {import("../types.js").Scene} Scene
 * @typedef {import("../types.js").Transfer} Transfer
 * @typedef {import("../types.js").Triple} Triple
 * @typedef {{width: number, height: number}} Size
 * @typedef {{name: string, file: Uint8Array, wasm: BufferSource, canvas: OffscreenCanvas | HTMLCanvasElement}} Input
 * @typedef {{level: number, origin: number[], bricks: number[], count: number}} Shape  of an atlas
 * @typedef {{scene: Scene, size: Size, full: Size, number: number, steps: number}} Job
 *   full: size that decides the level of detail; number: of the request, or kUninterrupted; steps: of the
 *   scene between two samples
 * @typedef {(head: PictureHead, canvas: OffscreenCanvas | HTMLCanvasElement) => Promise<void> | void} Show
 */
import { dot, frameOf, inverseOf, kCube, lengthOf, minus, placeOf, plus, times, unitOf } from "../camera.js";
import { Decoder } from "./decoder.js";
import { RayMarcher } from "./ray-marcher.js";

// The camera as the shader needs it, in the index space of a level of detail (libesvr/render/view.h, brick_march.h).
// Lengths along rays are those of the camera's space (esvr/camera.h).

/** Voxels of a level along the side of a pixel where it begins, as in the library. */
const kVoxelsPerPixel = 3;
const kLastLevel = 7;

/** A place in units of the voxels of a level. @param {Triple} place @param {number} level @returns {Triple} */
function placeInLevel(place, level) {
  const side = 2 ** level, offset = 0.5 * (side - 1);
  return /** @type {Triple} */ (place.map((v) => (v - offset) / side));
}

/** The plane of the picture: its height at a depth of 1, or in voxels for parallel rays. @param {Camera} camera */
const planeHeight = ({ fov, height }) => height ?? 2 * Math.tan(((fov ?? 30) * Math.PI) / 360);

/**
 * The axes of the picture as steps in the index space, and in the camera's space.
 * @param {Camera} camera @param {{width: number, height: number}} size
 * @param {number} level @param {Triple} origin  a voxel of the level, to which places are relative
 * @param {Edges | null} edges  of a voxel
 */
export function viewOf(camera, size, level, origin, edges) {
  const axes = frameOf(camera);
  const perspective = camera.height === undefined;
  const height = planeHeight(camera) / (perspective ? 1 : 2 ** level);
  const width = (height * size.width) / size.height;
  const rows = inverseOf(edges);
  const inIndex = (/** @type {Triple} */ v) => /** @type {Triple} */ (rows.map((row) => dot(row, v)));
  return {
    eye: minus(placeInLevel(inIndex(camera.eye), level), origin),
    right: inIndex(axes.right), up: inIndex(axes.up), forward: inIndex(axes.forward),
    axes, edges: edges ?? kCube, rows,
    perspective, left: -width / 2, top: height / 2, width, height,
  };
}

/**
 * The level of detail of a picture. The library changes levels along a ray; here, the middle of the
 * volume decides.
 * @param {Camera} camera @param {number} height  in pixels @param {Triple} middle  in index space
 * @param {Edges | null} edges  of a voxel
 */
function levelOf(camera, height, middle, edges) {
  const distance = camera.height === undefined ? lengthOf(minus(placeOf(edges, middle), camera.eye)) : 1;
  const voxel = Math.max(...(edges ?? kCube).map(lengthOf));
  const voxels = (planeHeight(camera) * distance) / height / (kVoxelsPerPixel * voxel);
  return Math.min(kLastLevel, Math.max(0, Math.floor(Math.log2(voxels))));
}

/** The direction to a light above the left shoulder of someone at the camera's place. */
const lightOf = (/** @type {ReturnType<typeof viewOf>} */ { axes: { right, up, forward } }) =>
  unitOf(minus(minus(times(up, 0.6), times(right, 0.5)), forward));

const kBins = 256; // of a histogram
const kMostTextureBytes = 512 * 2 ** 20;
const kBandMs = 40; // between two looks for a newer request
const kFirstPictureMs = 60; // a picture that takes longer has a coarse one before it
const kCoarseScale = 0.35; // of the size of a coarse picture
const kMovingMs = 50; // pictures of drags that would take longer have fewer samples
const kMostMovingSteps = 3; // between these samples
const kUsualSide = 128, kMostSide = 1024; // of the table of segments
const kEntriesOfGap = 2; // of the table of segments, between two points of a transfer function
const kUninterrupted = 0;
/** @type {Record<string, Triple>} */
const kDirections = { "+x": [1, 0, 0], "-x": [-1, 0, 0], "+y": [0, 1, 0], "-y": [0, -1, 0], "+z": [0, 0, 1], "-z": [0, 0, -1] };

/** Lets messages arrive. */
const turn = () => new Promise((resolve) => setTimeout(resolve, 0));

/** A clip box or a slice as a box of places. @param {Scene} scene @returns {[Triple, Triple] | null} */
function clipOf({ clip, slice }) {
  if (!slice) return clip;
  const box = /** @type {[Triple, Triple]} */ ([[-1e9, -1e9, -1e9], [1e9, 1e9, 1e9]]);
  const axis = "xyz".indexOf(slice.axis);
  box[0][axis] = slice.place - 0.5;
  box[1][axis] = slice.place + 0.5;
  return box;
}

/** Whether samples of a level cannot miss the clip box. @param {Scene} scene @param {number} level */
function fits(scene, level) {
  const clip = clipOf(scene), apart = 2 * 2 ** level * Math.max(scene.step, 1);
  return !clip || minus(clip[1], clip[0]).every((side) => side >= apart);
}

/** A file, its decoder and the graphics card that draws it. */
export class Engine {
  #decoder;
  #canvas;
  #marcher;
  #device;
  #file;
  #input;
  /** @type {Grid[]} */
  #grids;
  /** The grid whose volume is decoded. */
  #decoded = { grid: -1, volume: 0 };
  /** What the textures hold. */
  #shown = { grid: -1, level: -1, tables: "" };
  /** @type {Shape | null} */
  #atlas = null;
  #latest = 0;
  #drawMs = 0; // of the last picture
  /** Time of a pixel at the scene's step. */
  #msPerPixel = 0;

  /** @param {Input} input @param {Decoder} decoder */
  constructor(input, decoder) {
    this.#input = input;
    this.#decoder = decoder;
    this.#canvas = input.canvas;
    const options = { alpha: true, premultipliedAlpha: true, antialias: false, depth: false, preserveDrawingBuffer: true };
    const gl = /** @type {WebGL2RenderingContext | null} */ (this.#canvas.getContext("webgl2", options));
    if (!gl) throw new Error("This page draws with WebGL2, which this browser does not offer.");
    const info = gl.getExtension("WEBGL_debug_renderer_info");
    this.#device = String(gl.getParameter(info ? info.UNMASKED_RENDERER_WEBGL : gl.RENDERER));
    this.#marcher = new RayMarcher(gl);
    this.#file = decoder.open(input.file, input.name);
    this.#grids = decoder.grids(this.#file);
    if (this.#grids.length === 0) throw new Error(`${input.name} has no grid that can be drawn.`);
  }

  /** @param {Input} input */
  static async start(input) {
    return new Engine(input, await Decoder.load(input.wasm));
  }

  describe() {
    const { name, file } = this.#input, share = Math.round(file.length / this.#grids.length);
    const grids = this.#grids.map((grid) => ({ ...grid, bytes: share }));
    return {
      program: `ESVR ${this.#decoder.version()}, exported page`,
      device: `WebGL2, ${this.#device}`,
      files: [{ name, bytes: file.length, frames: [], grids }],
      ...this.#decoder.looks(),
      carried: this.#decoder.carried(this.#file),
    };
  }

  /** @param {FitRequest} request */
  fit({ grid, view, orthographic, width, height }) {
    const direction = kDirections[view] ?? null;
    const { box, edges } = this.#gridAt(grid);
    return this.#decoder.fit(box, { direction, orthographic, width, height, edges });
  }

  /** @param {Place} place */
  histogram({ grid }) {
    const range = this.#gridAt(grid).range;
    const counts = this.#decoder.histogram(this.#volumeOf(grid), range, kBins);
    return { low: range[0], high: range[1], counts };
  }

  /**
   * Draws a picture, a coarse one before it if it takes long. A later call ends an earlier one.
   * @param {DrawRequest} request @param {Show} show
   */
  async draw({ id, width, height, moving, scene }, show) {
    const number = ++this.#latest, size = { width, height };
    await turn();
    if (number !== this.#latest) return;
    const expectedMs = this.#msPerPixel * width * height;
    const steps = moving ? Math.min(kMostMovingSteps, Math.max(1, Math.ceil(expectedMs / kMovingMs))) : 1;
    if (!moving && expectedMs > kFirstPictureMs) {
      const small = { width: Math.ceil(width * kCoarseScale), height: Math.ceil(height * kCoarseScale) };
      if (!(await this.#paint({ scene, size: small, full: size, number, steps }))) return;
      await this.#show({ id, last: false }, show);
    }
    if (await this.#paint({ scene, size, full: size, number, steps })) await this.#show({ id, last: true }, show);
  }

  /** Draws a picture that nothing interrupts. @param {{scene: Scene} & Size} request */
  async png({ scene, width, height }) {
    const size = { width, height };
    await this.#paint({ scene, size, full: size, number: kUninterrupted, steps: 1 });
    this.#marcher.show();
    const canvas = this.#canvas;
    if ("convertToBlob" in canvas) return canvas.convertToBlob({ type: "image/png" });
    return new Promise((resolve) => canvas.toBlob(resolve, "image/png"));
  }

  /** @param {number} grid */
  #gridAt(grid) {
    if (!this.#grids[grid]) throw new Error(`There is no grid ${grid}.`);
    return this.#grids[grid];
  }

  /** @param {{id: number, last: boolean}} head @param {Show} show */
  async #show(head, show) {
    this.#marcher.show();
    const stats = { vramBytes: this.#marcher.bytes, level: this.#atlas?.level ?? 0 };
    await show({ ...head, drawMs: this.#drawMs, stats }, this.#canvas);
  }

  /**
   * Draws a picture in bands, between which a newer request may end it.
   * @param {Job} job
   * @returns {Promise<boolean>} whether the picture is complete
   */
  async #paint({ scene, size, full, number, steps }) {
    const frame = this.#prepare({ ...scene, step: scene.step * steps }, full), from = performance.now();
    let rows = Math.max(1, Math.floor((kBandMs * steps) / Math.max(1e-9, this.#msPerPixel * size.width)));
    this.#marcher.begin(frame, size);
    for (let row = 0; row < size.height; row += rows) {
      if (row > 0) {
        await turn();
        if (number !== kUninterrupted && number !== this.#latest) return false;
        this.#marcher.begin(frame, size); // another picture may have been drawn meanwhile
      }
      rows = Math.min(rows, size.height - row);
      this.#marcher.draw(row, rows);
    }
    this.#drawMs = performance.now() - from;
    this.#msPerPixel = (this.#drawMs * steps) / (size.width * size.height);
    return true;
  }

  /** Makes the textures of a scene. @param {Scene} scene @param {Size} size @returns {Frame} */
  #prepare(scene, size) {
    this.#decoder.checkCamera(scene.camera, size);
    const { box, edges } = this.#gridAt(scene.grid);
    const wanted = scene.lod === "auto" ? levelOf(scene.camera, size.height, times(plus(...box), 0.5), edges) : 0;
    this.#useVolume(scene.grid, fits(scene, wanted) ? wanted : 0);
    const { level, origin, bricks } = /** @type {Shape} */ (this.#atlas);
    this.#useTables(scene, level);
    const first = /** @type {Triple} */ (origin);
    const view = viewOf(scene.camera, size, level, first, edges);
    const clip = clipOf(scene)?.map((corner) => minus(placeInLevel(corner, level), first));
    const high = bricks.map((n) => 8 * n);
    return {
      kind: { mode: scene.mode, classification: scene.classification, shade: scene.shade },
      view,
      low: /** @type {Triple} */ (clip ? clip[0].map((v) => Math.max(v, 0)) : [0, 0, 0]),
      high: /** @type {Triple} */ (clip ? clip[1].map((v, a) => Math.min(v, high[a])) : high),
      step: scene.step,
      toLight: lightOf(view),
      background: scene.background,
    };
  }

  /** @param {number} grid */
  #volumeOf(grid) {
    if (this.#decoded.grid === grid) return this.#decoded.volume;
    this.#decoder.freeVolume(this.#decoded.volume);
    this.#decoded = { grid: -1, volume: 0 };
    this.#decoded = { grid, volume: this.#decoder.decode(this.#file, grid) };
    return this.#decoded.volume;
  }

  /** Uploads a grid in a level of detail, or in a coarser one if it is too large. */
  #useVolume(grid, level) {
    if (this.#shown.grid === grid && this.#shown.level === level) return;
    const limits = { mostSide: this.#marcher.mostSide, mostBytes: kMostTextureBytes };
    const atlas = this.#decoder.atlas(this.#volumeOf(grid), level, limits);
    try {
      this.#marcher.setAtlas(atlas);
      this.#atlas = { level: atlas.level, origin: atlas.origin, bricks: atlas.bricks, count: atlas.count };
      this.#shown = { ...this.#shown, grid, level };
    } finally {
      atlas.free();
    }
  }

  /**
   * The table of segments covers the values of the volume and those of the transfer function. Its entries
   * lie so close that a curve between two points of the function has several of them; beyond a limit, the
   * table covers the transfer function alone, which takes longer to draw.
   * @param {Transfer} transfer
   */
  #segmentsOf({ colors, opacity }) {
    const places = [...colors, ...opacity].map(([x]) => x).sort((a, b) => a - b);
    const low = places[0], high = places[places.length - 1];
    const gaps = places.slice(1).map((x, i) => x - places[i]).filter((gap) => gap > 0);
    const entries = Math.max(kUsualSide, kEntriesOfGap * ((high - low) / Math.min(...gaps)));
    const values = this.#marcher.values, first = Math.min(low, ...values), last = Math.max(high, ...values);
    const side = Math.ceil((entries * (last - first)) / (high - low));
    const own = /** @type {[number, number]} */ ([low, high]), all = /** @type {[number, number]} */ ([first, last]);
    return side <= kMostSide ? { range: all, side } : { range: own, side: Math.ceil(Math.min(kMostSide, entries)) };
  }

  /** @param {Scene} scene @param {number} level */
  #useTables({ transfer, mode, classification, step, opacityLength }, level) {
    const composite = mode === "composite";
    const length = composite ? (step * 2 ** level) / opacityLength : 1;
    const none = { range: /** @type {[number, number]} */ ([0, 1]), side: 0 };
    const segments = composite && classification === "pre" ? this.#segmentsOf(transfer) : none;
    const key = JSON.stringify([transfer, length, segments]);
    if (this.#shown.tables === key) return;
    const tables = this.#decoder.tables(transfer, { length, ...segments });
    this.#marcher.setTables(tables);
    tables.free();
    this.#shown.tables = key;
  }
}
