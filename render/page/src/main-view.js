/**
 * The page of esvr-view: asks the program for pictures over a WebSocket.
 * @typedef {import("./types.js").Backend} Backend
 * @typedef {import("./types.js").Picture} Picture
 * @typedef {{id: number, onPicture: (picture: Picture) => void, resolve: () => void,
 *   reject: (error: Error) => void}} Drawing
 * @typedef {{message: object, resolve: (answer: any) => void, reject: (error: Error) => void}} Question
 */
import "./page.css";
import { startPage } from "./viewer.jsx";

const kFirstRetryMs = 500, kLastRetryMs = 8000;

/** The address of the socket of a page. */
function socketAddress() {
  return location.href.split("#")[0].replace(/^http/, "ws") + "socket";
}

/**
 * The parts of a binary message: a length, a JSON head and bytes.
 * @param {ArrayBuffer} data
 */
function partsOf(data) {
  const length = new DataView(data).getUint32(0, true);
  const head = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, length)));
  return { head, bytes: data.slice(4 + length) };
}

/** @implements {Backend} */
class ServerBackend {
  can = new Set(["command", "png", "preset", "compare", "frames", "shade", "lod", "between", "classification"]);
  /** @type {WebSocket | null} */
  #socket = null;
  /** Messages that wait for the connection. @type {string[]} */
  #unsent = [];
  /** Answers to these carry no number, so only the first one is asked. @type {Question[]} */
  #questions = [];
  /** @type {Drawing | null} */
  #drawing = null;
  /** @type {Map<number, Question>} */
  #files = new Map();
  #nextFile = 1;
  #retryMs = kFirstRetryMs;
  /** @type {(open: boolean) => void} */
  #listener = () => {};

  constructor() {
    this.#connect();
  }

  /** @param {(open: boolean) => void} listener */
  onConnection(listener) {
    this.#listener = listener;
  }

  describe() {
    return this.#ask({ type: "describe" });
  }

  /** @type {Backend["fit"]} */
  async fit(request) {
    return (await this.#ask({ type: "fit", ...request })).camera;
  }

  /** @type {Backend["histogram"]} */
  async histogram(place) {
    return (await this.#ask({ type: "histogram", ...place })).histogram;
  }

  /** @type {Backend["command"]} */
  command(request) {
    return this.#ask({ type: "command", ...request });
  }

  /** @type {Backend["preset"]} */
  async preset(text) {
    return (await this.#ask({ type: "preset", text })).presets;
  }

  /** @type {Backend["draw"]} */
  draw(request, onPicture) {
    this.#drawing?.resolve();
    return new Promise((resolve, reject) => {
      this.#drawing = { id: request.id, onPicture, resolve, reject };
      this.#send({ type: "draw", ...request });
    });
  }

  /** @type {Backend["png"]} */
  png(request) {
    // The numbers of pictures and of files are apart, because a failure names only a number.
    const id = 1e9 + this.#nextFile++;
    const message = { type: "png", id, ...request };
    return new Promise((resolve, reject) => {
      this.#files.set(id, { message, resolve, reject });
      this.#send(message);
    });
  }

  #connect() {
    const socket = new WebSocket(socketAddress());
    socket.binaryType = "arraybuffer";
    socket.onopen = () => this.#opened();
    socket.onclose = () => this.#closed();
    socket.onmessage = ({ data }) =>
      typeof data === "string" ? this.#readText(JSON.parse(data)) : this.#readBinary(data);
    this.#socket = socket;
  }

  #opened() {
    this.#retryMs = kFirstRetryMs;
    for (const text of this.#unsent.splice(0)) this.#socket?.send(text);
    this.#listener(true);
  }

  #closed() {
    const error = new Error("The connection to esvr-view has ended.");
    this.#drawing?.reject(error);
    this.#drawing = null;
    for (const question of [...this.#questions.splice(0), ...this.#files.values()]) question.reject(error);
    this.#files.clear();
    this.#unsent = [];
    this.#listener(false);
    setTimeout(() => this.#connect(), this.#retryMs);
    this.#retryMs = Math.min(2 * this.#retryMs, kLastRetryMs);
  }

  /** @param {object} message */
  #send(message) {
    const text = JSON.stringify(message);
    if (this.#socket?.readyState === WebSocket.OPEN) this.#socket.send(text);
    else this.#unsent.push(text);
  }

  /**
   * @param {object} message
   * @returns {Promise<any>}
   */
  #ask(message) {
    return new Promise((resolve, reject) => {
      this.#questions.push({ message, resolve, reject });
      if (this.#questions.length === 1) this.#send(message);
    });
  }

  /** The first question has its answer; asks the next one. */
  #answered() {
    const question = this.#questions.shift();
    if (this.#questions.length > 0) this.#send(this.#questions[0].message);
    return question;
  }

  /** @param {any} message */
  #readText(message) {
    if (message.type === "failed") this.#failed(message);
    else this.#answered()?.resolve(message);
  }

  /** @param {{id?: number, text: string}} message */
  #failed({ id, text }) {
    const error = new Error(text);
    if (id === undefined) return this.#answered()?.reject(error);
    if (this.#files.has(id)) this.#takeFile(id)?.reject(error);
    else if (this.#drawing?.id === id) this.#takeDrawing()?.reject(error);
  }

  /** @param {number} id */
  #takeFile(id) {
    const file = this.#files.get(id);
    this.#files.delete(id);
    return file;
  }

  #takeDrawing() {
    const drawing = this.#drawing;
    this.#drawing = null;
    return drawing;
  }

  /** @param {ArrayBuffer} data */
  async #readBinary(data) {
    const { head, bytes } = partsOf(data);
    if (head.type === "png")
      return this.#takeFile(head.id)?.resolve(new Blob([bytes], { type: "image/png" }));
    const drawing = this.#drawing;
    if (drawing?.id !== head.id) return;
    const bitmap = await createImageBitmap(new Blob([bytes], { type: "image/jpeg" }));
    // A later request may have come while the picture was decoded.
    if (this.#drawing !== drawing || !drawing) return bitmap.close();
    if (head.last) this.#drawing = null;
    drawing.onPicture({ id: head.id, last: head.last, bitmap, head });
    if (head.last) drawing.resolve();
  }
}

startPage(new ServerBackend());
