import { useEffect } from "preact/hooks";

/**
 * Calls back for turns of the wheel with Ctrl, as which trackpads send pinches. Others scroll the page.
 * @param {{current: HTMLElement | SVGElement | null}} ref @param {(event: WheelEvent) => void} onWheel
 */
export function useWheel(ref, onWheel) {
  useEffect(() => {
    const listen = (/** @type {any} */ event) => {
      if (!event.ctrlKey && !event.metaKey) return;
      event.preventDefault();
      onWheel(event);
    };
    ref.current?.addEventListener("wheel", listen, { passive: false });
    return () => ref.current?.removeEventListener("wheel", listen);
  });
}
