/**
 * What the exported page contains: the .esvr file, which `esvr-view --export` has put there, and the
 * decoder, which build.mjs has put there.
 */
import { partOf } from "./packed.js";

/** @param {Document} page */
export async function contentOf(page) {
  const element = page.getElementById("esvr-file"), base64 = element?.textContent?.trim();
  if (!base64) throw new Error("This page has no file in it. `esvr-view --export` writes pages that have one.");
  const file = Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
  return { name: element?.dataset.name || "volume.esvr", file, wasm: await partOf("esvr-decoder") };
}
