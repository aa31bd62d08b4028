/**
 * Moves the camera by mouse, pen, touch, wheel and keys.
 * @typedef {import("./types.js").Camera} Camera
 * @typedef {{x: number, y: number}} Place
 * @typedef {{camera: () => Camera, move: (camera: Camera) => void, fit: () => void}} Target
 */
import { orbited, panned, zoomed, zoomedAt } from "./camera.js";

const kTurnPerHeight = Math.PI; // of a drag over the height of the picture
const kWheelPixels = 500; // for a zoom by e
const kLinePixels = 16; // a line of a wheel that counts lines
const kKeyTurn = Math.PI / 24, kKeyShift = 0.05, kKeyZoom = 1.15;

/**
 * Shares of the element's height, to the right and upwards.
 * @param {HTMLElement} element @param {number} dx @param {number} dy
 * @returns {[number, number]}
 */
function shareOf(element, dx, dy) {
  const height = element.clientHeight || 1;
  return [dx / height, -dy / height];
}

/** A place relative to the middle of the element. @param {HTMLElement} element @param {number} x @param {number} y */
function placeIn(element, x, y) {
  const box = element.getBoundingClientRect();
  return shareOf(element, x - box.left - box.width / 2, y - box.top - box.height / 2);
}

/** @param {PointerEvent} event */
const pans = (event) => event.buttons & 6 || event.shiftKey || event.ctrlKey || event.metaKey;

/**
 * One pointer turns or shifts.
 * @param {Camera} camera @param {HTMLElement} element @param {PointerEvent} event @param {Place} from
 */
function dragged(camera, element, event, from) {
  const [x, y] = shareOf(element, event.clientX - from.x, event.clientY - from.y);
  return pans(event) ? panned(camera, x, y) : orbited(camera, x * kTurnPerHeight, -y * kTurnPerHeight);
}

/**
 * Two pointers zoom and shift.
 * @param {Camera} camera @param {HTMLElement} element @param {any} before @param {any} after  two places each
 */
function pinched(camera, element, before, after) {
  const middle = ([a, b]) => ({ x: (a.x + b.x) / 2, y: (a.y + b.y) / 2 });
  const apart = ([a, b]) => Math.max(1, Math.hypot(a.x - b.x, a.y - b.y));
  const from = middle(before), to = middle(after);
  const moved = panned(camera, ...shareOf(element, to.x - from.x, to.y - from.y));
  return zoomedAt(moved, apart(after) / apart(before), ...placeIn(element, to.x, to.y));
}

/** @param {HTMLElement} element @param {Target} target @param {AbortSignal} signal */
function listenToPointers(element, target, signal) {
  /** @type {Map<number, Place>} */
  const pointers = new Map();
  const on = (type, act) => element.addEventListener(type, act, { signal });
  const release = (event) => pointers.delete(event.pointerId);
  on("pointerdown", (event) => {
    element.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
  });
  on("pointermove", (event) => {
    const from = pointers.get(event.pointerId);
    if (!from) return;
    const before = [...pointers.values()];
    pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    const camera = target.camera();
    if (before.length === 1) target.move(dragged(camera, element, event, from));
    if (before.length === 2) target.move(pinched(camera, element, before, [...pointers.values()]));
  });
  on("pointerup", release);
  on("pointercancel", release);
  on("contextmenu", (event) => event.preventDefault());
  on("dblclick", () => target.fit());
}

/** @param {HTMLElement} element @param {Target} target @param {AbortSignal} signal */
function listenToWheel(element, target, signal) {
  const listen = (/** @type {WheelEvent} */ event) => {
    event.preventDefault();
    const pixels = event.deltaY * (event.deltaMode === WheelEvent.DOM_DELTA_LINE ? kLinePixels : 1);
    const [x, y] = placeIn(element, event.clientX, event.clientY);
    target.move(zoomedAt(target.camera(), Math.exp(-pixels / kWheelPixels), x, y));
  };
  element.addEventListener("wheel", listen, { passive: false, signal });
}

/** The camera after a key; nothing for other keys. @param {Camera} camera @param {KeyboardEvent} event */
function cameraAfterKey(camera, { key, shiftKey }) {
  const arrow = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[key];
  if (arrow && shiftKey) return panned(camera, arrow[0] * kKeyShift, arrow[1] * kKeyShift);
  if (arrow) return orbited(camera, arrow[0] * kKeyTurn, arrow[1] * kKeyTurn);
  if (key === "+" || key === "=") return zoomed(camera, kKeyZoom);
  if (key === "-" || key === "_") return zoomed(camera, 1 / kKeyZoom);
  return undefined;
}

/** @param {HTMLElement} element @param {Target} target @param {AbortSignal} signal */
function listenToKeys(element, target, signal) {
  const listen = (/** @type {KeyboardEvent} */ event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const camera = cameraAfterKey(target.camera(), event);
    if (camera) target.move(camera);
    else if (event.key === "0" || event.key === "Home") target.fit();
    else return;
    event.preventDefault();
  };
  element.addEventListener("keydown", listen, { signal });
}

/** @param {HTMLElement} element @param {Target} target @returns {() => void} ends it */
export function listenToGestures(element, target) {
  const ending = new AbortController();
  for (const listen of [listenToPointers, listenToWheel, listenToKeys]) listen(element, target, ending.signal);
  return () => ending.abort();
}
