/**
 * What the page knows about the grid that is shown.
 * @typedef {import("./types.js").Histogram} Histogram
 */
import { useEffect, useRef, useState } from "preact/hooks";

/**
 * The histogram of a grid; null until it is there.
 * @param {import("./types.js").Backend} backend @param {import("./types.js").Grid} grid
 * @param {import("./types.js").Scene} scene @param {boolean} still  the scene does not move
 * @returns {Histogram | null}
 */
export function useHistogram(backend, grid, { file, grid: index, frame }, still) {
  const [histogram, setHistogram] = useState(grid.histogram);
  const asked = useRef("");
  useEffect(() => {
    const place = `${file}/${index}/${frame}`;
    if (!still || grid.histogram || asked.current === place) return;
    asked.current = place;
    const show = (/** @type {Histogram | null} */ found) => asked.current === place && setHistogram(found);
    // The editor works without one.
    backend.histogram({ file, grid: index, frame }).then(show, () => show(null));
  }, [file, index, frame, still]);
  return grid.histogram ?? histogram;
}
