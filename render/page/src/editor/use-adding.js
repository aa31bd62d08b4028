/**
 * Adds points where the diagram is pressed.
 * @typedef {{value: number, opacity: number}} Place
 */
import { useRef } from "preact/hooks";
import { follow } from "../parts/drag.js";

/**
 * @param {(event: MouseEvent) => Place} placeOf
 * @param {(place: Place) => (place: Place) => void} onAdd  adds a point; what it returns moves the point
 */
export function useAdding(placeOf, onAdd) {
  const pointerType = useRef("");
  const onPointerDown = (/** @type {PointerEvent} */ event) => {
    pointerType.current = event.pointerType;
    // A finger may want to scroll: it adds a point when it is lifted at the same place.
    if (event.button !== 0 || event.pointerType === "touch") return;
    const move = onAdd(placeOf(event));
    follow(event, (e) => move(placeOf(e)));
  };
  const onClick = (/** @type {MouseEvent} */ event) => {
    if (pointerType.current === "touch") onAdd(placeOf(event));
  };
  return { onPointerDown, onClick };
}
