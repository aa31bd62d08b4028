/**
 * The canvases of the picture.
 * @typedef {import("./painter.js").Shown} Shown
 */

/** @param {HTMLCanvasElement} canvas @param {ImageBitmap | HTMLCanvasElement} bitmap */
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
export function showPicture({ main, reference }, { layer, picture }) {
  copy(layer === "reference" ? reference : main, picture.bitmap);
  if (layer === "whole") reference.hidden = true;
  if (layer === "reference") reference.hidden = false;
}
