/**
 * Draws the scene whenever it changes: never asks the backend for a second picture before the first one was shown,
 * and always for the latest scene.
 * @typedef {import("./types.js").Backend} Backend
 * @typedef {import("./types.js").Picture} Picture
 * @typedef {import("./types.js").PictureHead} PictureHead
 * @typedef {import("./types.js").Scene} Scene
 * @typedef {"whole" | "own" | "reference"} Layer
 *   A comparison at rest has two layers, so that the border between them can be moved at once.
 * @typedef {{scene: Scene, moving: boolean, width: number, height: number}} Wish
 * @typedef {{layer: Layer, scene: Scene}} Part
 * @typedef {{picture: Picture, layer: Layer, wish: Wish, ms: number}} Shown
 * @typedef {ReturnType<typeof usePainting>} Painting
 */
import { useEffect, useRef, useState } from "preact/hooks";

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

/** The pictures that the backend is asked for, and those that it gave. */
class Painter {
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

/** Puts a picture onto a canvas. @param {HTMLCanvasElement} canvas @param {ImageBitmap | HTMLCanvasElement} bitmap */
function copy(canvas, bitmap) {
  // Setting the size clears a canvas, which would flicker.
  if (canvas.width !== bitmap.width || canvas.height !== bitmap.height)
    Object.assign(canvas, { width: bitmap.width, height: bitmap.height });
  canvas.getContext("2d")?.drawImage(bitmap, 0, 0);
  if (bitmap instanceof ImageBitmap) bitmap.close();
}

/**
 * Shows a picture. The reference is over the volume, and is seen only once it is complete.
 * @param {{main: HTMLCanvasElement, reference: HTMLCanvasElement}} canvases @param {Shown} shown
 */
function showPicture({ main, reference }, { layer, picture }) {
  copy(layer === "reference" ? reference : main, picture.bitmap);
  if (layer === "whole") reference.hidden = true;
  if (layer === "reference") reference.hidden = false;
}

const kSmoothing = 0.2; // weight of the latest picture in the rate of pictures
const kLongestPauseMs = 500; // pictures that are further apart belong to two drags

/** What the statistics show after a picture. */
function speedAfter(before, { picture, wish, ms }, now) {
  const interval = before ? now - before.at : Infinity;
  const fits = wish.moving && interval < kLongestPauseMs;
  const rate = 1000 / interval;
  const fps = fits ? (before.fps ? before.fps + kSmoothing * (rate - before.fps) : rate) : (before?.fps ?? null);
  const { width, height } = picture.bitmap;
  return { at: now, fps, ms, width, height, drawMs: picture.head.drawMs, vramBytes: picture.head.stats.vramBytes ?? 0, level: picture.head.stats.level ?? 0 };
}

/** @param {PictureHead} head */
const errorsOf = (head) =>
  head.maxDifference === undefined ? null : { psnr: head.psnr ?? null, maxDifference: head.maxDifference };

/**
 * The canvases, on which the scene is drawn whenever it changes, and what is known of the last picture.
 * @param {Backend} backend
 * @param {{scene: Scene, moving: boolean, size: {width: number, height: number}, connection: number}} wish
 *   connection: changes when there is a new one
 */
export function usePainting(backend, { scene, moving, size, connection }) {
  const canvases = { main: useRef(/** @type {any} */ (null)), reference: useRef(/** @type {any} */ (null)) };
  const [speed, setSpeed] = useState(/** @type {any} */ (null));
  const [errors, setErrors] = useState(/** @type {ReturnType<typeof errorsOf>} */ (null));
  const [failure, setFailure] = useState("");
  const [busy, setBusy] = useState(true);
  const shownFrame = useRef(/** @type {number | null | undefined} */ (undefined));
  const onShown = (/** @type {Shown} */ shown) => {
    const { picture, layer, wish } = shown;
    // Sizes are gone once the picture is shown.
    setSpeed((before) => speedAfter(before, shown, performance.now()));
    setFailure("");
    shownFrame.current = wish.scene.frame;
    // A later wish may already wait.
    const isLatest = wish.scene === scene && wish.width === size.width && wish.height === size.height;
    if (picture.last && !wish.moving && isLatest && layer !== "own") setErrors(errorsOf(picture.head)), setBusy(false);
    showPicture({ main: canvases.main.current, reference: canvases.reference.current }, shown);
  };
  const painter = useRef(/** @type {Painter | null} */ (null));
  painter.current ??= new Painter(backend, (s) => handlers.current.onShown(s), (e) => handlers.current.onError(e));
  const handlers = useRef(/** @type {any} */ (null));
  handlers.current = { onShown, onError: (/** @type {Error} */ e) => (setFailure(e.message), setBusy(false)) };
  useEffect(() => {
    if (!size.width || !size.height) return;
    if (painter.current?.paint({ scene, moving, ...size })) setBusy(true);
  }, [scene, moving, size.width, size.height, connection]);
  return { canvases, speed, errors: scene.compare ? errors : null, failure, busy, shownFrame };
}
