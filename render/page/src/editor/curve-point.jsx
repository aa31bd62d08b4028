import { hexOf } from "../look/css-color.js";
import { shortText } from "../look/number-text.js";
import { colorAt } from "../look/transfer.js";
import { follow } from "../parts/drag.js";

// Shares of an axis that the arrow keys move a point by; with Shift, steps are finer.
const kCoarse = 0.02, kFine = 0.002;

/** @param {KeyboardEvent} event */
function directionOf({ key }) {
  return { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[key];
}

/**
 * A point of the opacity curve.
 * @param {object} props
 * @param {import("../types.js").Transfer} props.transfer
 * @param {number} props.index
 * @param {boolean} props.selected
 * @param {import("./scales.js").Scales} props.scales
 * @param {() => void} props.onSelect
 * @param {(value: number, opacity: number) => void} props.onMove
 * @param {() => void} props.onRemove
 */
export function CurvePoint({ transfer, index, selected, scales, onSelect, onMove, onRemove }) {
  const [value, opacity] = transfer.opacity[index];
  const [x, y] = [scales.x(value), scales.y(opacity)];
  const onPointerDown = (/** @type {PointerEvent} */ event) => {
    event.stopPropagation();
    onSelect();
    if (event.button === 2) return;
    const [dx, dy] = [x - event.clientX, y - event.clientY];
    follow(event, (e) => onMove(scales.valueAt(e.clientX + dx), scales.opacityAt(e.clientY + dy)));
  };
  const onKeyDown = (/** @type {KeyboardEvent} */ event) => {
    if (event.key === "Delete" || event.key === "Backspace") return onRemove();
    const direction = directionOf(event);
    if (!direction) return;
    event.preventDefault();
    const share = event.shiftKey ? kFine : kCoarse;
    const [right, up] = direction;
    onMove(value + right * share * (scales.high - scales.low), scales.raised(opacity, up * share));
  };
  return (
    <g
      class={selected ? "point selected" : "point"} transform={`translate(${x},${y})`} tabindex={0} role="slider"
      aria-label={`Opacity point ${index + 1} of ${transfer.opacity.length}`}
      aria-valuenow={opacity} aria-valuemin={0} aria-valuemax={1}
      aria-valuetext={`opacity ${shortText(opacity)} at value ${shortText(value)}`}
      onPointerDown={onPointerDown} onClick={(/** @type {Event} */ event) => event.stopPropagation()} onKeyDown={onKeyDown} onFocus={onSelect}
      onContextMenu={(/** @type {Event} */ event) => (event.preventDefault(), onRemove())}
    >
      <circle class="reach" r="14" />
      <circle class="dot" r={selected ? 7 : 5.5} fill={hexOf(colorAt(transfer, value))} />
    </g>
  );
}
