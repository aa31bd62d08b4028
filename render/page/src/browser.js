/**
 * What the browser does for the page: it follows pointers, measures elements, saves files and keeps the theme.
 * @typedef {ReturnType<typeof useSize>} Area
 */
import { useEffect, useLayoutEffect, useRef, useState } from "preact/hooks";

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

/** An element's size in CSS pixels. Give `ref` to the element. */
export function useSize() {
  const ref = useRef(/** @type {any} */ (null));
  const [size, setSize] = useState({ width: 0, height: 0 });
  useLayoutEffect(() => {
    const measure = () => {
      const { width, height } = ref.current.getBoundingClientRect();
      setSize((old) => (old.width === width && old.height === height ? old : { width, height }));
    };
    const observer = new ResizeObserver(measure);
    observer.observe(ref.current);
    measure();
    return () => observer.disconnect();
  }, []);
  return { ref, size };
}

/** Hands a file to the browser, which saves it. @param {Blob} blob @param {string} name */
export function saveBlob(blob, name) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
}

/** @param {string} text @param {string} name @param {string} type */
export const saveText = (text, name, type) => saveBlob(new Blob([text], { type }), name);

/**
 * Puts a text on the clipboard, which browsers allow on secure pages only.
 * @param {string} text @returns {Promise<boolean>} whether it was possible
 */
export async function copyText(text) {
  try {
    await navigator.clipboard.writeText(text);
    return true;
  } catch {
    return false;
  }
}

const kThemeKey = "esvr-theme";
/** The browser keeps which of them was chosen. */
export const kThemes = /** @type {const} */ (["system", "light", "dark"]);

/** The theme that was chosen last. @returns {string} */
export function storedTheme() {
  try {
    return localStorage.getItem(kThemeKey) ?? "system";
  } catch {
    return "system"; // browsers may refuse to store anything
  }
}

/** Shows a theme, and remembers it. @param {string} theme */
export function applyTheme(theme) {
  document.documentElement.dataset.theme = theme;
  try {
    localStorage.setItem(kThemeKey, theme);
  } catch {
    // The theme then lasts as long as the page.
  }
}
