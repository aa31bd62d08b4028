import { hexOf } from "../look/css-color.js";
import { colorAt } from "../look/transfer.js";

/**
 * Colors from a value to another one, as the background of an element.
 * @param {{space: string, colors: import("../types.js").ColorPoint[]}} look
 * @param {import("../look/transfer.js").Range} range @param {number} [stops]
 */
export function rampStyle(look, [low, high], stops = 32) {
  const colors = Array.from({ length: stops + 1 }, (_, i) => hexOf(colorAt(look, low + ((high - low) * i) / stops)));
  return { backgroundImage: `linear-gradient(to right, ${colors.join(",")})` };
}
