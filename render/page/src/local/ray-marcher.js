/**
 * Draws a volume with WebGL2.
 * @typedef {import("../types.js").Triple} Triple
 * @typedef {import("../types.js").Scene} Scene
 * @typedef {import("./decoder.js").Atlas} Atlas
 * @typedef {import("./decoder.js").Tables} Tables
 * @typedef {{width: number, height: number}} Size
 * @typedef {{mode: "composite" | "maximum" | "average", classification: "pre" | "post", shade: boolean, inTable: boolean}} Kind
 *   inTable: all values lie within the table of segments
 *
 * @typedef {object} Frame  What decides the pixels of a picture.
 * @property {Omit<Kind, "inTable">} kind
 * @property {ReturnType<typeof import("./engine.js").viewOf>} view
 * @property {Triple} low @property {Triple} high  the box to draw, relative to the atlas
 * @property {number} step
 * @property {Triple} toLight
 * @property {Triple | null} background
 */
import { fragmentShader, kTableRow, kVertexShader } from "./shaders.js";

const kMinTransmittance = 1 / 4096; // as in the library
const kSlotSide = 9;
const kFlat = 1e30; // intervals per unit of value of a transfer function without extent

/** @param {WebGL2RenderingContext} gl @param {number} type @param {string} text */
function compiled(gl, type, text) {
  const shader = /** @type {WebGLShader} */ (gl.createShader(type));
  gl.shaderSource(shader, text);
  gl.compileShader(shader);
  if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS) && !gl.isContextLost())
    throw new Error(`The graphics driver refuses a shader: ${gl.getShaderInfoLog(shader)}`);
  return shader;
}

/** @param {WebGL2RenderingContext} gl @param {string} fragment */
function linked(gl, fragment) {
  const program = /** @type {WebGLProgram} */ (gl.createProgram());
  gl.attachShader(program, compiled(gl, gl.VERTEX_SHADER, kVertexShader));
  gl.attachShader(program, compiled(gl, gl.FRAGMENT_SHADER, fragment));
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost())
    throw new Error(`The graphics driver refuses a program: ${gl.getProgramInfoLog(program)}`);
  return program;
}

/** An array that fills the rows of a texture. @param {Float32Array} values */
function padded(values) {
  const row = 4 * kTableRow;
  const all = new Float32Array(Math.ceil(values.length / row) * row);
  all.set(values);
  return all;
}

/** Places of the ends of the table of segments. @param {Pick<Tables, "low" | "scale" | "range">} tables @returns {[number, number]} */
function segmentPlaces({ low, scale, range: [first, last] }) {
  return [(first - low) * (scale || kFlat), (last - low) * (scale || kFlat)];
}

export class RayMarcher {
  #gl;
  #floats;
  /** @type {Map<string, {program: WebGLProgram, places: Map<string, WebGLUniformLocation | null>}>} */
  #programs = new Map();
  #bricks;
  #voxels;
  #values;
  #segments;
  #target;
  #pixels;
  #size = { width: 0, height: 0 };
  /** @type {Omit<Atlas, "table" | "voxels" | "free"> | null} */
  #atlas = null;
  /** @type {Omit<Tables, "values" | "segments" | "free"> | null} */
  #tables = null;
  #bytes = 0;

  /** @param {WebGL2RenderingContext} gl */
  constructor(gl) {
    this.#gl = gl;
    // Half floats can be filtered everywhere; floats are more precise, and faster on a CPU.
    const filtersFloats = gl.getExtension("OES_texture_float_linear") !== null;
    this.#floats = filtersFloats ? { red: gl.R32F, rgba: gl.RGBA32F } : { red: gl.R16F, rgba: gl.RGBA16F };
    this.#bricks = gl.createTexture();
    this.#voxels = gl.createTexture();
    this.#values = gl.createTexture();
    this.#segments = gl.createTexture();
    this.#target = gl.createFramebuffer();
    this.#pixels = gl.createTexture();
    gl.bindVertexArray(gl.createVertexArray());
  }

  /** Largest side of a texture. */
  get mostSide() {
    return this.#gl.getParameter(this.#gl.MAX_3D_TEXTURE_SIZE);
  }
  /** Memory of the textures. */
  get bytes() {
    return this.#bytes;
  }

  /** Uploads a volume. @param {Atlas} atlas */
  setAtlas(atlas) {
    const gl = this.#gl, { table, voxels, free, ...rest } = atlas;
    const [bx, by, bz] = atlas.bricks, [sx, sy, sz] = atlas.slots.map((n) => n * kSlotSide);
    this.#bind(0, gl.TEXTURE_3D, this.#bricks, gl.NEAREST);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    gl.texImage3D(gl.TEXTURE_3D, 0, gl.RGBA8UI, bx, by, bz, 0, gl.RGBA_INTEGER, gl.UNSIGNED_BYTE, table);
    this.#bind(1, gl.TEXTURE_3D, this.#voxels, gl.LINEAR);
    gl.texImage3D(gl.TEXTURE_3D, 0, this.#floats.red, sx, sy, sz, 0, gl.RED, gl.FLOAT, voxels);
    if (gl.getError() === gl.OUT_OF_MEMORY) throw new Error("The volume does not fit into the memory of the graphics card.");
    this.#bytes = table.byteLength + voxels.byteLength / (this.#floats.red === gl.R32F ? 1 : 2);
    this.#atlas = rest;
  }

  /** Uploads a transfer function. @param {Tables} tables */
  setTables(tables) {
    const gl = this.#gl, { values, segments, free, ...rest } = tables;
    const colors = padded(values), side = tables.side;
    this.#bind(2, gl.TEXTURE_2D, this.#values, gl.NEAREST);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32F, kTableRow, colors.length / (4 * kTableRow), 0, gl.RGBA, gl.FLOAT, colors);
    this.#bind(3, gl.TEXTURE_2D, this.#segments, gl.LINEAR);
    if (segments) gl.texImage2D(gl.TEXTURE_2D, 0, this.#floats.rgba, side, side, 0, gl.RGBA, gl.FLOAT, segments);
    this.#tables = rest;
  }

  /** Prepares a picture of a size, which the rows of draw() fill. @param {Frame} frame @param {Size} size */
  begin(frame, size) {
    const gl = this.#gl;
    this.#resize(size);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.#target);
    gl.viewport(0, 0, size.width, size.height);
    this.#setUniforms(this.#programOf({ ...frame.kind, inTable: this.#isInTable() }), frame, size);
  }

  /** Draws some rows of the picture, and waits for them. @param {number} first @param {number} count */
  draw(first, count) {
    const gl = this.#gl, { width, height } = this.#size;
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.#target);
    gl.enable(gl.SCISSOR_TEST);
    gl.scissor(0, height - first - count, width, count);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.disable(gl.SCISSOR_TEST);
    gl.readPixels(0, height - first - 1, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
    if (gl.isContextLost()) throw new Error("The graphics card has been lost. Reload the page.");
  }

  /** Puts the picture onto the canvas. */
  show() {
    const gl = this.#gl, { width, height } = this.#size;
    if (gl.canvas.width !== width || gl.canvas.height !== height) Object.assign(gl.canvas, { width, height });
    gl.bindFramebuffer(gl.READ_FRAMEBUFFER, this.#target);
    gl.bindFramebuffer(gl.DRAW_FRAMEBUFFER, null);
    gl.blitFramebuffer(0, 0, width, height, 0, 0, width, height, gl.COLOR_BUFFER_BIT, gl.NEAREST);
  }

  /** @param {Size} size */
  #resize({ width, height }) {
    const gl = this.#gl;
    if (width === this.#size.width && height === this.#size.height) return;
    this.#bind(4, gl.TEXTURE_2D, this.#pixels, gl.LINEAR);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA8, width, height, 0, gl.RGBA, gl.UNSIGNED_BYTE, null);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.#target);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, this.#pixels, 0);
    this.#size = { width, height };
  }

  /** @param {number} unit @param {number} target @param {WebGLTexture | null} texture @param {number} filter */
  #bind(unit, target, texture, filter) {
    const gl = this.#gl;
    gl.activeTexture(gl.TEXTURE0 + unit);
    gl.bindTexture(target, texture);
    for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(target, name, filter);
    for (const name of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T, gl.TEXTURE_WRAP_R]) gl.texParameteri(target, name, gl.CLAMP_TO_EDGE);
  }

  /** @param {Kind} kind */
  #programOf(kind) {
    const key = JSON.stringify(kind);
    const known = this.#programs.get(key) ?? { program: linked(this.#gl, fragmentShader(kind)), places: new Map() };
    this.#programs.set(key, known);
    this.#gl.useProgram(known.program);
    return known;
  }

  /** Smallest and largest value of the volume, and its background. */
  get values() {
    const { shares, scale, background } = /** @type {Atlas} */ (this.#atlas);
    return shares.map((share) => share * scale + background);
  }

  /** Whether all values lie within the table of segments. */
  #isInTable() {
    const [first, last] = /** @type {Tables} */ (this.#tables).range, slack = 1e-4 * (last - first);
    return this.values.every((value) => value >= first - slack && value <= last + slack);
  }

  /** Places in the tables for shares of the atlas' scale: a factor and the place of the background. */
  #places() {
    const t = /** @type {Tables} */ (this.#tables), a = /** @type {Atlas} */ (this.#atlas);
    if (t.scale === 0) return { scale: kFlat, background: a.background < t.low ? -kFlat : t.intervals };
    return { scale: a.scale * t.scale, background: (a.background - t.low) * t.scale };
  }

  /**
   * @param {{program: WebGLProgram, places: Map<string, WebGLUniformLocation | null>}} known
   * @param {Frame} frame @param {Size} size
   */
  #setUniforms({ program, places }, frame, size) {
    const gl = this.#gl, { view } = frame, tables = /** @type {Tables} */ (this.#tables);
    const at = (/** @type {string} */ name) => {
      if (!places.has(name)) places.set(name, gl.getUniformLocation(program, name));
      return places.get(name) ?? null;
    };
    const vector = (/** @type {string} */ name, /** @type {number[]} */ v) => gl.uniform3f(at(name), v[0], v[1], v[2]);
    const number = (/** @type {string} */ name, /** @type {number} */ v) => gl.uniform1f(at(name), v);
    const place = this.#places();
    vector("uEye", view.eye);
    vector("uRight", view.right);
    vector("uUp", view.up);
    vector("uForward", view.forward);
    gl.uniform1i(at("uPerspective"), view.perspective ? 1 : 0);
    gl.uniform2f(at("uPixel"), view.width / size.width, view.height / size.height);
    number("uLeft", view.left);
    number("uTop", view.top);
    number("uHeight", size.height);
    vector("uLow", frame.low);
    vector("uHigh", frame.high);
    number("uStep", frame.step);
    number("uMinTransmittance", kMinTransmittance);
    vector("uTexel", /** @type {Atlas} */ (this.#atlas).slots.map((n) => 1 / (n * kSlotSide)));
    number("uPlaceScale", place.scale);
    number("uPlaceOfBackground", place.background);
    gl.uniform2f(at("uSegmentPlaces"), ...segmentPlaces(tables));
    number("uSegmentSide", tables.side);
    gl.uniform4fv(at("uBelow"), tables.below);
    gl.uniform4fv(at("uAbove"), tables.above);
    number("uLeastBend", tables.leastBend);
    vector("uToLight", frame.toLight);
    gl.uniformMatrix3fv(at("uEdges"), false, view.edges.flat());
    gl.uniformMatrix3fv(at("uRows"), false, view.rows.flat());
    number("uWeakSquared", tables.weakGradientSquared * (place.scale / (this.#atlas?.scale ?? 1)) ** 2);
    gl.uniform4f(at("uBackground"), ...(frame.background ?? [0, 0, 0]), frame.background ? 1 : 0);
    ["uBricks", "uVoxels", "uValues", "uSegments"].forEach((name, unit) => gl.uniform1i(at(name), unit));
  }
}
