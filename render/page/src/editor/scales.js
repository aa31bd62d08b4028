/**
 * The axes of the editor.
 * @typedef {import("../transfer.js").Range} Range
 * @typedef {{width: number, height: number}} Size
 * @typedef {"linear" | "fine"} OpacityScale
 * @typedef {ReturnType<typeof scalesOf>} Scales
 */

export const kMargins = Object.freeze({ left: 38, right: 12, top: 10, bottom: 24 });

// A cube root shows an opacity of 0.001 at a tenth of the height, and still has a place for 0.
const kPower = 3;
/** @param {OpacityScale} scale @param {number} opacity  @returns {number} share of the height */
const heightOf = (scale, opacity) => (scale === "fine" ? Math.cbrt(opacity) : opacity);
/** @param {OpacityScale} scale @param {number} share */
const opacityOf = (scale, share) => (scale === "fine" ? share ** kPower : share);
/** @param {number} v */
const unit = (v) => Math.min(1, Math.max(0, v));

/** Shares of an axis that the arrow keys move a point by; with Shift, steps are finer. */
export const kCoarse = 0.02, kFine = 0.002;

/** @param {Size} size @param {Range} shown  values at the left and right end @param {OpacityScale} scale */
export function scalesOf({ width, height }, [low, high], scale) {
  const { left, right, top, bottom } = kMargins;
  const inner = { width: Math.max(1, width - left - right), height: Math.max(1, height - top - bottom) };
  const extent = high - low || 1;
  return {
    left, top, ...inner, low, high,
    x: (/** @type {number} */ value) => left + ((value - low) / extent) * inner.width,
    y: (/** @type {number} */ opacity) => top + (1 - heightOf(scale, opacity)) * inner.height,
    valueAt: (/** @type {number} */ x) => low + ((x - left) / inner.width) * extent,
    opacityAt: (/** @type {number} */ y) => opacityOf(scale, unit(1 - (y - top) / inner.height)),
    /** An opacity that lies a share of the height higher. */
    raised: (/** @type {number} */ opacity, /** @type {number} */ share) =>
      opacityOf(scale, unit(heightOf(scale, opacity) + share)),
  };
}

const kDenser = 0.8; // ticks may be closer than asked for, if their numbers are rounder then

/** Round numbers from low to high, about `count` of them. @param {Range} range @param {number} count */
export function ticksOf([low, high], count) {
  const rough = (high - low) / count;
  if (!(rough > 0)) return [low];
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = power * ([1, 2, 5].find((m) => m * power >= kDenser * rough) ?? 10);
  const first = Math.ceil(low / step), last = Math.floor(high / step + 1e-9);
  return Array.from({ length: last - first + 1 }, (_, i) => (first + i) * step);
}

/** @type {Record<OpacityScale, number[]>} */
export const kOpacityTicks = { linear: [0, 0.25, 0.5, 0.75, 1], fine: [0, 0.001, 0.01, 0.1, 0.5, 1] };
