import { hexOf } from "../look/css-color.js";
import { shortText } from "../look/number-text.js";
import { follow } from "../parts/drag.js";

const kCoarse = 0.02, kFine = 0.002; // shares of the axis that the arrow keys move a point by; fine with Shift

/**
 * A color point on the bar of colors.
 * @param {object} props
 * @param {import("../types.js").ColorPoint[]} props.colors
 * @param {number} props.index
 * @param {import("../look/transfer.js").Range} props.shown
 * @param {number} props.width  of the bar in pixels
 * @param {boolean} props.selected
 * @param {() => void} props.onSelect
 * @param {(value: number) => void} props.onMove
 * @param {() => void} props.onRemove
 */
export function ColorHandle({ colors, index, shown: [low, high], width, selected, onSelect, onMove, onRemove }) {
  const [value, ...color] = colors[index];
  const onKeyDown = (/** @type {KeyboardEvent} */ event) => {
    if (event.key === "Delete" || event.key === "Backspace") return onRemove();
    const sign = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (!sign) return;
    event.preventDefault();
    onMove(value + sign * (event.shiftKey ? kFine : kCoarse) * (high - low));
  };
  const onPointerDown = (/** @type {PointerEvent} */ event) => {
    event.stopPropagation();
    onSelect();
    follow(event, (e) => onMove(value + ((e.clientX - event.clientX) / width) * (high - low)));
  };
  return (
    <span
      class={selected ? "handle selected" : "handle"} role="slider" tabindex={0}
      style={{ left: `${(100 * (value - low)) / (high - low)}%`, background: hexOf(color) }}
      aria-label={`Color point ${index + 1} of ${colors.length}`}
      aria-valuenow={value} aria-valuemin={low} aria-valuemax={high}
      aria-valuetext={`color ${hexOf(color)} at value ${shortText(value)}`}
      onPointerDown={onPointerDown} onKeyDown={onKeyDown} onFocus={onSelect}
    />
  );
}
