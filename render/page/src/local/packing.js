/**
 * Bytes as text with 91 printable characters (J. Henke, "basE91", 2005), which is 8 % shorter than base64.
 * The characters are others than Henke's: none of them ends a script of HTML.
 */
const kCharacters = Array.from({ length: 94 }, (_, i) => String.fromCharCode(33 + i)).filter((c) => !"<\\`".includes(c));
const kBase = kCharacters.length;
const kBits = 13, kMask = 2 ** kBits - 1;
const kShort = kBase ** 2 - 2 ** kBits - 1; // smaller pairs have another bit

/** @param {Uint8Array} bytes */
export function encoded(bytes) {
  let text = "", bits = 0, count = 0;
  for (const byte of bytes) {
    bits |= byte << count;
    count += 8;
    if (count <= kBits) continue;
    const taken = (bits & kMask) > kShort ? kBits : kBits + 1, pair = bits & (2 ** taken - 1);
    bits >>= taken;
    count -= taken;
    text += kCharacters[pair % kBase] + kCharacters[Math.floor(pair / kBase)];
  }
  if (count > 0) text += kCharacters[bits % kBase] + (count > 7 || bits >= kBase ? kCharacters[Math.floor(bits / kBase)] : "");
  return text;
}

/** @param {string} text @returns {Uint8Array<ArrayBuffer>} */
export function decoded(text) {
  const values = new Map(kCharacters.map((c, i) => [c, i]));
  const bytes = [];
  let bits = 0, count = 0;
  for (let i = 0; i + 1 < text.length; i += 2) {
    const pair = (values.get(text[i]) ?? 0) + kBase * (values.get(text[i + 1]) ?? 0);
    bits |= pair << count;
    count += (pair & kMask) > kShort ? kBits : kBits + 1;
    for (; count > 7; count -= 8, bits >>= 8) bytes.push(bits & 255);
  }
  if (text.length % 2 === 1) bytes.push((bits | ((values.get(text[text.length - 1]) ?? 0) << count)) & 255);
  return new Uint8Array(bytes);
}

/** The bytes of a part of the exported page that build.mjs has compressed. @param {string} id  of its script element */
export async function partOf(id) {
  const bytes = decoded(document.getElementById(id)?.textContent?.trim() ?? "");
  return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"))).arrayBuffer();
}
