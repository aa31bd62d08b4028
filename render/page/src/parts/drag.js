/**
 * Follows a pointer from its press until it is released, also outside the element.
 * @param {PointerEvent} event  the press
 * @param {(event: PointerEvent) => void} onMove
 * @param {() => void} [onEnd]
 */
export function follow(event, onMove, onEnd = () => {}) {
  const target = /** @type {Element} */ (event.currentTarget);
  const ending = new AbortController(), { signal } = ending, { pointerId } = event;
  target.setPointerCapture(pointerId);
  const own = (/** @type {(event: PointerEvent) => void} */ act) => (/** @type {Event} */ e) => {
    if (/** @type {PointerEvent} */ (e).pointerId === pointerId) act(/** @type {PointerEvent} */ (e));
  };
  const end = own(() => (ending.abort(), onEnd()));
  target.addEventListener("pointermove", own(onMove), { signal });
  target.addEventListener("pointerup", end, { signal });
  target.addEventListener("pointercancel", end, { signal });
}
