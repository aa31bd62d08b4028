/** The parts of the exported page that build.mjs has compressed. */
import { decoded } from "./base91.js";

/** The bytes of a part. @param {string} id  of its script element */
export async function partOf(id) {
  const bytes = decoded(document.getElementById(id)?.textContent?.trim() ?? "");
  return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"))).arrayBuffer();
}
