/**
 * The exported page: draws the .esvr file that it contains.
 * @typedef {import("./types.js").Backend} Backend
 * @typedef {import("./types.js").Picture} Picture
 * @typedef {{name: string, file: Uint8Array, wasm: ArrayBuffer}} Content
 */
import "./page.css";
// The engine follows the worker, which contains it too, so that the compressed page has it once.
import workerText from "worker:./local/worker.js";
import { Engine } from "./local/engine.js";
import { commandOf } from "./local/command.js";
import { partOf } from "./local/packing.js";
import { presetsOf } from "./paraview.js";
import { startPage } from "./viewer.jsx";

/** The file, which `esvr-view --export` has put into the page, and the decoder, which build.mjs has. @param {Document} page */
async function contentOf(page) {
  const element = page.getElementById("esvr-file"), base64 = element?.textContent?.trim();
  if (!base64) throw new Error("This page has no file in it. `esvr-view --export` writes pages that have one.");
  const file = Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
  return { name: element?.dataset.name || "volume.esvr", file, wasm: await partOf("esvr-decoder") };
}

/** An engine in a worker. */
class RemoteEngine {
  /** @type {Map<number, {resolve: (result: any) => void, reject: (error: Error) => void}>} */
  #calls = new Map();
  #number = 0;
  #worker;
  /** @type {(picture: Picture) => void} */
  onPicture = () => {};

  /** @param {Content} content */
  constructor(content) {
    const address = URL.createObjectURL(new Blob([workerText], { type: "text/javascript" }));
    this.#worker = new Worker(address);
    this.#worker.onmessage = ({ data }) => (data.picture ? this.onPicture(data.picture) : this.#answered(data));
    this.#worker.onerror = ({ message }) => this.#failed(new Error(message || "The worker of the page has failed."));
    this.#worker.postMessage({ call: "start", request: content });
  }

  /** @param {string} call @param {object} [request] @returns {Promise<any>} */
  ask(call, request) {
    const number = ++this.#number;
    return new Promise((resolve, reject) => {
      this.#calls.set(number, { resolve, reject });
      this.#worker.postMessage({ number, call, request });
    });
  }

  /** @param {{number: number, result?: any, error?: string}} answer */
  #answered({ number, result, error }) {
    const call = this.#calls.get(number);
    this.#calls.delete(number);
    if (error === undefined) call?.resolve(result);
    else call?.reject(new Error(error));
  }

  /** @param {Error} error */
  #failed(error) {
    for (const call of this.#calls.values()) call.reject(error);
    this.#calls.clear();
  }
}

/** An engine on the page itself, for browsers whose workers cannot draw with WebGL2. */
class PageEngine {
  #engine;
  /** @type {(picture: Picture) => void} */
  onPicture = () => {};

  /** @param {Content} content */
  constructor(content) {
    this.#engine = Engine.start({ ...content, canvas: document.createElement("canvas") });
  }

  /** @param {string} call @param {any} [request] @returns {Promise<any>} */
  async ask(call, request) {
    const engine = await this.#engine;
    const show = async (/** @type {any} */ head, /** @type {any} */ canvas) =>
      this.onPicture({ id: head.id, last: head.last, bitmap: await createImageBitmap(canvas), head });
    return call === "draw" ? engine.draw(request, show) : /** @type {any} */ (engine)[call](request);
  }
}

function workersDraw() {
  try {
    return Boolean(new OffscreenCanvas(1, 1).getContext("webgl2"));
  } catch {
    return false;
  }
}

/** Draws the file of the page. @implements {Backend} */
class LocalBackend {
  can = new Set(["command", "png", "preset", "shade", "lod", "classification"]);
  #engine;
  /** @type {any} */
  #description = null;
  /** @type {{id: number, onPicture: (picture: Picture) => void} | null} */
  #drawing = null;

  /** @param {Content} content */
  constructor(content) {
    this.#engine = workersDraw() ? new RemoteEngine(content) : new PageEngine(content);
    this.#engine.onPicture = (picture) => {
      const drawing = this.#drawing;
      if (drawing && drawing.id === picture.id) drawing.onPicture(picture);
      else if (picture.bitmap instanceof ImageBitmap) picture.bitmap.close();
    };
  }

  onConnection() {
    // A page is always connected to itself.
  }

  async describe() {
    return (this.#description = await this.#engine.ask("describe"));
  }

  /** @type {Backend["fit"]} */
  fit(request) {
    return this.#engine.ask("fit", request);
  }

  /** @type {Backend["histogram"]} */
  histogram(place) {
    return this.#engine.ask("histogram", place);
  }

  /** @type {Backend["draw"]} */
  draw(request, onPicture) {
    this.#drawing = { id: request.id, onPicture };
    return this.#engine.ask("draw", request);
  }

  /** @type {Backend["png"]} */
  png(request) {
    return this.#engine.ask("png", request);
  }

  /** @type {Backend["command"]} */
  async command(request) {
    return commandOf(request, this.#description);
  }

  /** @type {Backend["preset"]} */
  async preset(text) {
    return presetsOf(text);
  }
}

contentOf(document).then(
  (content) => startPage(new LocalBackend(content)),
  (error) => (document.getElementById("page") ?? document.body).replaceChildren(error.message),
);
