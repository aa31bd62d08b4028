/**
 * The address of the page.
 * @typedef {import("./types.js").Scene} Scene
 * @typedef {import("./types.js").Description} Description
 */
import { useEffect, useRef } from "preact/hooks";
import { hashOf, sceneOf } from "./state/link.js";

/**
 * Keeps the scene in the address, and takes it from there when the user changes it.
 * @param {import("./state/store.js").Store} store @param {Description} description
 * @param {(scene: Omit<Scene, "camera">) => void} onWithoutCamera  for addresses that have none
 */
export function useAddress(store, description, onWithoutCamera) {
  const { scene, moving } = store;
  const latest = useRef(onWithoutCamera);
  latest.current = onWithoutCamera; // the listener lives as long as the page
  useEffect(() => {
    if (!moving) history.replaceState(null, "", hashOf(scene, description));
  }, [scene, moving]);
  useEffect(() => {
    const listen = () => {
      const { camera, ...found } = sceneOf(location.hash, description);
      if (camera) store.set({ ...found, camera });
      else latest.current(found);
    };
    addEventListener("hashchange", listen);
    return () => removeEventListener("hashchange", listen);
  }, []);
}
