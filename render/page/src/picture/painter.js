/**
 * Asks the backend for pictures: never for a second one before the first one was shown, and always
 * for the latest scene.
 * @typedef {import("../types.js").Backend} Backend
 * @typedef {import("../types.js").Picture} Picture
 * @typedef {import("../types.js").Scene} Scene
 * @typedef {"whole" | "own" | "reference"} Layer
 *   A comparison at rest has two layers, so that the border between them can be moved at once.
 * @typedef {{scene: Scene, moving: boolean, width: number, height: number}} Wish
 * @typedef {{layer: Layer, scene: Scene}} Part
 * @typedef {{picture: Picture, layer: Layer, wish: Wish, ms: number}} Shown
 */

/** Time from a request to the picture that drags aim at, and the smallest pictures that they draw. */
const kAimedMs = 70, kLeastScale = 0.35;
const kMovingQuality = 0.75, kRestingQuality = 0.93;

/** The pictures that a wish consists of. @param {Wish} wish @returns {Part[]} */
function partsOf({ scene, moving }) {
  const { compare } = scene;
  if (moving || compare?.show !== "split") return [{ layer: "whole", scene }];
  return [
    { layer: "own", scene: { ...scene, compare: null } },
    { layer: "reference", scene: { ...scene, compare: { ...compare, show: "reference" } } },
  ];
}

/** What the layers of a comparison depend on: everything but the border between them. @param {Wish} wish */
function keyOf({ scene, width, height }) {
  return JSON.stringify({ ...scene, compare: scene.compare && { ...scene.compare, split: 0 }, width, height });
}

export class Painter {
  #backend;
  #onShown;
  #onError;
  /** @type {Wish | null} */
  #next = null;
  #waiting = false; // for the first picture of a request
  #id = 0;
  /** The comparison whose layers are both complete. */
  #complete = "";
  /** Drags draw pictures of this share of the size, so that slow machines follow them. */
  #scale = 1;

  /**
   * @param {Backend} backend @param {(shown: Shown) => void} onShown
   * @param {(error: Error) => void} onError
   */
  constructor(backend, onShown, onError) {
    this.#backend = backend;
    this.#onShown = onShown;
    this.#onError = onError;
  }

  /** @param {Wish} wish @returns {boolean} whether there is something to draw */
  paint(wish) {
    if (wish.scene.compare?.show === "split" && this.#complete === keyOf(wish)) return false;
    this.#complete = "";
    this.#next = wish;
    if (!this.#waiting) this.#start();
    return true;
  }

  async #start() {
    const wish = this.#next;
    if (!wish) return;
    this.#next = null;
    for (const part of partsOf(wish)) if (!(await this.#draw(wish, part))) return;
    if (!wish.moving && !this.#next) this.#complete = keyOf(wish);
  }

  /** @param {Wish} wish @param {Part} part @returns {Promise<boolean>} whether it was drawn completely */
  async #draw(wish, part) {
    const id = ++this.#id, began = performance.now();
    this.#waiting = true;
    const scale = wish.moving ? this.#scale : 1;
    const size = { width: Math.round(wish.width * scale), height: Math.round(wish.height * scale) };
    const quality = wish.moving ? kMovingQuality : kRestingQuality;
    const request = { id, ...size, moving: wish.moving, quality, scene: part.scene };
    try {
      await this.#backend.draw(request, (picture) => this.#show(id, picture, { ...part, wish, began }));
    } catch (error) {
      if (id === this.#id) this.#failed(/** @type {Error} */ (error));
    }
    return id === this.#id;
  }

  /** @param {number} id @param {Picture} picture @param {Part & {wish: Wish, began: number}} of */
  #show(id, picture, { layer, wish, began }) {
    if (id !== this.#id) return;
    const ms = performance.now() - began;
    if (wish.moving) this.#scale = Math.min(1, Math.max(kLeastScale, this.#scale * Math.sqrt(kAimedMs / ms)));
    this.#onShown({ picture, layer, wish, ms });
    this.#release();
  }

  /** @param {Error} error */
  #failed(error) {
    this.#onError(error);
    this.#release();
  }

  #release() {
    this.#waiting = false;
    if (this.#next) this.#start();
  }
}
