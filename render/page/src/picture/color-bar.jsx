import { rampStyle } from "../editor/color-ramp.jsx";
import { shortText } from "../look/number-text.js";
import { rangeOf } from "../look/transfer.js";

/**
 * The meaning of the colors, over the picture.
 * @param {{transfer: import("../types.js").Transfer, name: string, unit: string}} props
 */
export function ColorBar({ transfer, name, unit }) {
  const [low, high] = rangeOf(transfer), middle = (low + high) / 2;
  return (
    <figure class="color-bar">
      <figcaption>{name}{unit && ` (${unit})`}</figcaption>
      <span class="ramp" style={rampStyle(transfer, [low, high])} />
      <span class="ends"><span>{shortText(low)}</span><span>{shortText(middle)}</span><span>{shortText(high)}</span></span>
    </figure>
  );
}
