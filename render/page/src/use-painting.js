/**
 * Draws the scene whenever it changes.
 * @typedef {import("./types.js").Scene} Scene
 * @typedef {import("./picture/painter.js").Shown} Shown
 */
import { useEffect, useRef, useState } from "preact/hooks";
import { showPicture } from "./picture/layers.js";
import { Painter } from "./picture/painter.js";

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

/** @param {import("./types.js").PictureHead} head */
const errorsOf = (head) =>
  head.maxDifference === undefined ? null : { psnr: head.psnr ?? null, maxDifference: head.maxDifference };

/**
 * @param {import("./types.js").Backend} backend
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
