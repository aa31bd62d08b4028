/**
 * The library's decoder as WebAssembly (libesvr/page/page.cpp): files, volumes and the tables of drawing.
 * @typedef {import("../types.js").Triple} Triple
 * @typedef {import("../types.js").Transfer} Transfer
 * @typedef {import("../types.js").Camera} Camera
 *
 * @typedef {object} Atlas  The bricks of a volume as textures; the arrays are views of the module's memory.
 * @property {number} level @property {number[]} origin @property {number[]} bricks @property {number[]} slots
 * @property {number} count @property {number} background @property {number} scale
 * @property {number[]} shares  that of the smallest voxel, of the background and of the largest voxel
 * @property {Uint8Array} table @property {Float32Array} voxels @property {() => void} free
 *
 * @typedef {object} Tables  The tables of a transfer function; views of the module's memory.
 * @property {number} intervals @property {number} low @property {number} scale @property {number} weakGradientSquared
 * @property {number} leastBend
 * @property {Float32Array} values @property {Float32Array | null} segments
 * @property {[number, number]} range @property {number} side  of the table of segments
 * @property {number[]} below @property {number[]} above @property {() => void} free
 */

const kSpaces = ["RGB", "HSV", "HSVWrap", "Lab", "Diverging", "Step"];
const kWordBytes = 4, kDoubleBytes = 8;
const kVoxelsOfSlot = 9 * 9 * 9;

/** Camera as ten numbers, the last of which is the field of view or the height. @param {Camera} camera */
const numbersOf = ({ eye, center, up, fov, height }) => [...eye, ...center, ...up, height ?? fov ?? 30];

export class Decoder {
  /** @type {any} */
  #exports;

  /** @param {BufferSource} wasm  the bytes of the module */
  static async load(wasm) {
    const decoder = new Decoder();
    const refuse = () => {
      throw new Error("The decoder has ended unexpectedly.");
    };
    const { instance } = await WebAssembly.instantiate(wasm, {
      env: { emscripten_notify_memory_growth: () => {} },
      wasi_snapshot_preview1: { proc_exit: refuse },
    });
    decoder.#exports = instance.exports;
    decoder.#exports._initialize();
    return decoder;
  }

  version() {
    return this.#text(this.#exports.esvr_version());
  }

  /** Opens a file. @param {Uint8Array} bytes @param {string} name @returns {number} the file */
  open(bytes, name) {
    return this.#scoped((take) => {
      const at = take(bytes.length), out = take(kWordBytes);
      new Uint8Array(this.#memory, at, bytes.length).set(bytes);
      this.#check(this.#exports.esvr_open_memory(at, bytes.length, this.#putText(take, name), 0n, out));
      return this.#words(out, 1)[0];
    });
  }

  /** @param {number} file @returns {import("../types.js").Grid[]} */
  grids(file) {
    return this.#json(this.#exports.page_grids(file));
  }

  /** @returns {{colormaps: object, opacities: object}} */
  looks() {
    return this.#json(this.#exports.page_looks());
  }

  /** Names of grids that only OpenVDB can read. @param {number} file @returns {string[]} */
  carried(file) {
    const count = this.#exports.esvr_carried_count(file);
    return Array.from({ length: count }, (_, i) => this.#text(this.#exports.esvr_carried_name(file, i)));
  }

  /** Decodes a grid, without voxels that are NaN or infinite. @param {number} file @param {number} grid @returns {number} the volume */
  decode(file, grid) {
    return this.#scoped((take) => {
      const out = take(kWordBytes);
      this.#check(this.#exports.page_decode(file, grid, out));
      return this.#words(out, 1)[0];
    });
  }

  /** @param {number} volume */
  freeVolume(volume) {
    this.#exports.esvr_free_volume(volume);
  }

  /** @param {number} volume @param {[number, number]} range @param {number} count @returns {number[]} */
  histogram(volume, [low, high], count) {
    return this.#scoped((take) => {
      const out = take(count * kDoubleBytes);
      this.#exports.page_histogram(volume, low, high, count, out);
      return [...new Float64Array(this.#memory, out, count)];
    });
  }

  /**
   * @param {number} volume @param {number} level
   * @param {{mostSide: number, mostBytes: number}} limits
   * @returns {Atlas}
   */
  atlas(volume, level, { mostSide, mostBytes }) {
    const at = this.#orFail(this.#exports.page_make_atlas(volume, level, mostSide, mostBytes));
    const words = [...new Int32Array(this.#memory, at, 17)];
    const [background, scale, least, most] = new Float32Array(this.#memory, at + 11 * kWordBytes, 4);
    const origin = words.slice(1, 4), bricks = words.slice(4, 7), slots = words.slice(7, 10);
    const size = (/** @type {number[]} */ sides) => sides[0] * sides[1] * sides[2];
    return {
      level: words[0], origin, bricks, slots, count: words[10], background, scale, shares: [least, 0, most],
      table: new Uint8Array(this.#memory, words[15] >>> 0, 4 * size(bricks)),
      voxels: new Float32Array(this.#memory, words[16] >>> 0, kVoxelsOfSlot * size(slots)),
      free: () => this.#exports.page_free_atlas(at),
    };
  }

  /**
   * @param {Transfer} transfer
   * @param {{length: number, range: [number, number], side: number}} sampling
   *   range and side: of the table of segments; a side of 0: none is wanted
   * @returns {Tables}
   */
  tables(transfer, { length, range, side }) {
    return this.#scoped((take) => {
      const head = take(5 * kWordBytes);
      const space = kSpaces.indexOf(transfer.space);
      if (space < 0) throw new Error(`There is no color space '${transfer.space}'.`);
      const colors = this.#putNumbers(take, transfer.colors.flat());
      const opacity = this.#putNumbers(take, transfer.opacity.flat());
      this.#words(head, 5).set([space, transfer.colors.length, transfer.opacity.length, colors, opacity]);
      const sampling = this.#putNumbers(take, [length, ...range, 0]);
      this.#words(sampling + 3 * kDoubleBytes, 1)[0] = side;
      const at = this.#orFail(this.#exports.page_make_tables(head, sampling));
      const words = this.#words(at, 7), floats = [...new Float32Array(this.#memory, at, 15)];
      const [intervals, , , , , values, segments] = words;
      return {
        intervals, low: floats[1], scale: floats[2], weakGradientSquared: floats[3], leastBend: floats[4], range, side,
        values: new Float32Array(this.#memory, values, 4 * (intervals + 1)),
        segments: segments ? new Float32Array(this.#memory, segments, 4 * side * side) : null,
        below: floats.slice(7, 11), above: floats.slice(11, 15), free: () => this.#exports.page_free_tables(at),
      };
    });
  }

  /**
   * @param {[Triple, Triple]} box
   * @param {{direction: Triple | null, orthographic: boolean, width: number, height: number, edges: import("../types.js").Edges | null}} wish
   * @returns {Camera}
   */
  fit(box, { direction, orthographic, width, height, edges }) {
    return this.#scoped((take) => {
      const corners = take(6 * kWordBytes), out = take(10 * kDoubleBytes);
      this.#words(corners, 6).set(box.flat());
      const from = direction ? this.#putNumbers(take, direction) : 0;
      const voxel = edges ? this.#putNumbers(take, edges.flat()) : 0;
      this.#exports.page_fit(corners, voxel, from, orthographic ? 1 : 0, width, height, out);
      const n = [...new Float64Array(this.#memory, out, 10)];
      const places = { eye: n.slice(0, 3), center: n.slice(3, 6), up: n.slice(6, 9) };
      return /** @type {any} */ ({ ...places, [orthographic ? "height" : "fov"]: n[9] });
    });
  }

  /** Throws an Error whose text says what is wrong. @param {Camera} camera @param {{width: number, height: number}} size */
  checkCamera(camera, { width, height }) {
    this.#scoped((take) => {
      const numbers = this.#putNumbers(take, numbersOf(camera));
      const parallel = camera.height === undefined ? 0 : 1;
      this.#check(this.#exports.page_check_camera(numbers, parallel, width, height));
    });
  }

  get #memory() {
    return this.#exports.memory.buffer; // another one after each growth
  }

  /** @param {number} at @param {number} count */
  #words(at, count) {
    return new Uint32Array(this.#memory, at, count);
  }

  /** The text that ends with 0. @param {number} at */
  #text(at) {
    const bytes = new Uint8Array(this.#memory, at);
    return new TextDecoder().decode(bytes.slice(0, bytes.indexOf(0)));
  }

  /** The content of a text that is not needed any more. @param {number} at */
  #json(at) {
    const content = JSON.parse(this.#text(this.#orFail(at)));
    this.#exports.free(at);
    return content;
  }

  /** Gives memory to a task, and takes it back. @template T @param {(take: (bytes: number) => number) => T} task @returns {T} */
  #scoped(task) {
    /** @type {number[]} */
    const taken = [];
    const take = (/** @type {number} */ bytes) => {
      const at = this.#exports.malloc(Math.max(bytes, 1)) >>> 0;
      if (!at) throw new Error("There is not enough memory.");
      taken.push(at);
      return at;
    };
    try {
      return task(take);
    } finally {
      for (const at of taken) this.#exports.free(at);
    }
  }

  /** @param {(bytes: number) => number} take @param {string} text */
  #putText(take, text) {
    const bytes = new TextEncoder().encode(text + "\0");
    const at = take(bytes.length);
    new Uint8Array(this.#memory, at, bytes.length).set(bytes);
    return at;
  }

  /** @param {(bytes: number) => number} take @param {number[]} numbers */
  #putNumbers(take, numbers) {
    const at = take(numbers.length * kDoubleBytes);
    new Float64Array(this.#memory, at, numbers.length).set(numbers);
    return at;
  }

  /** @param {number} status */
  #check(status) {
    if (status !== 0) throw new Error(this.#text(this.#exports.esvr_error()));
  }

  /** A pointer that is not null. @param {number} pointer */
  #orFail(pointer) {
    if (!pointer) throw new Error(this.#text(this.#exports.esvr_error()));
    return pointer >>> 0;
  }
}
