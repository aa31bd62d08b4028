/**
 * Holds the scene, and tells the page when it changes.
 * @typedef {import("../types.js").Scene} Scene
 */

/** A scene that did not change for so long is drawn completely. */
const kRestMs = 180;
const kMostUndone = 200;

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
