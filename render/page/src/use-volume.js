/**
 * What the page knows about the grid that is shown.
 * @typedef {import("./types.js").Histogram} Histogram
 */
import { useEffect, useState } from "preact/hooks";

/**
 * The histogram of a grid; null until it is there.
 * @param {import("./types.js").Backend} backend @param {import("./types.js").Grid} grid
 * @param {import("./types.js").Scene} scene @param {boolean} still  the scene does not move
 * @returns {Histogram | null}
 */
export function useHistogram(backend, grid, { file, grid: index, frame }, still) {
  const [histogram, setHistogram] = useState(grid.histogram);
  useEffect(() => {
    if (!still || grid.histogram) return;
    let wanted = true;
    const show = (/** @type {Histogram | null} */ found) => wanted && setHistogram(found);
    // The editor works without one.
    backend.histogram({ file, grid: index, frame }).then(show, () => show(null));
    return () => void (wanted = false);
  }, [file, index, frame, still]);
  return grid.histogram ?? histogram;
}
