/**
 * Starts the page: asks what there is to see, and shows the scene of the address.
 * @typedef {import("./types.js").Backend} Backend
 */
import { render } from "preact";
import { useEffect, useState } from "preact/hooks";
import { sceneOf } from "./state/link.js";
import { Store } from "./state/store.js";
import { applyTheme, storedTheme } from "./theme.js";
import { Viewer } from "./viewer.jsx";

/** The size for which the first camera is fitted: most of the window is the picture. */
const firstSize = () => ({ width: Math.max(1, innerWidth), height: Math.max(1, innerHeight) });

/** @param {Backend} backend */
async function begin(backend) {
  const description = await backend.describe();
  const { camera, ...scene } = sceneOf(location.hash, description);
  const { file, grid, frame } = scene;
  const usual = () => backend.fit({ file, grid, frame, ...firstSize(), view: "default", orthographic: false });
  const store = new Store({ ...scene, camera: camera ?? (await usual()) });
  return { description, store, fitFirst: camera === undefined };
}

/** @param {{backend: Backend}} props */
function Page({ backend }) {
  const [started, setStarted] = useState(/** @type {Awaited<ReturnType<typeof begin>> | null} */ (null));
  const [error, setError] = useState("");
  useEffect(() => {
    begin(backend).then(setStarted, (e) => setError(e.message));
  }, []);
  if (started) return <Viewer backend={backend} {...started} />;
  return (
    <main class="starting">
      {error ? <p role="alert">{error}</p> : <p role="status">Opening the volume…</p>}
    </main>
  );
}

/** @param {Backend} backend */
export function startPage(backend) {
  const root = /** @type {HTMLElement} */ (document.getElementById("page"));
  applyTheme(storedTheme());
  root.replaceChildren();
  render(<Page backend={backend} />, root);
}
