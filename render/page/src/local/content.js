/**
 * What the exported page contains: the .esvr file, which `esvr-view --export` has put there, and the
 * decoder, which build.mjs has put there.
 */

/** @param {Document} page @param {string} id */
function textOf(page, id) {
  const text = page.getElementById(id)?.textContent?.trim() ?? "";
  if (!text) throw new Error("This page has no file in it. `esvr-view --export` writes pages that have one.");
  return text;
}

/** @param {string} text  base64 @returns {Uint8Array<ArrayBuffer>} */
const bytesOf = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));

/** @param {Uint8Array<ArrayBuffer>} bytes */
const unzipped = (bytes) => new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"))).arrayBuffer();

/** @param {Document} page */
export async function contentOf(page) {
  const file = bytesOf(textOf(page, "esvr-file"));
  const name = page.getElementById("esvr-file")?.dataset.name || "volume.esvr";
  return { name, file, wasm: await unzipped(bytesOf(textOf(page, "esvr-decoder"))) };
}
