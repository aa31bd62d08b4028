/** Numbers as people read them. */

/** At most `digits` significant digits. @param {number} v @param {number} [digits] */
export function shortText(v, digits = 4) {
  if (v === 0) return "0";
  const size = Math.abs(v);
  return size >= 1e6 || size < 1e-4 ? v.toExponential(digits - 2).replace(/\.?0+e/, "e") : String(Number(v.toPrecision(digits)));
}

/** @param {number} bytes */
export function bytesText(bytes) {
  const units = ["bytes", "KB", "MB", "GB", "TB"];
  let power = 0;
  for (; bytes >= 1000 && power < units.length - 1; ++power) bytes /= 1000;
  return `${power === 0 ? bytes : Number(bytes.toPrecision(3))} ${units[power]}`;
}

/** With separators between thousands. @param {number} v */
export const countText = (v) => v.toLocaleString("en-US");
