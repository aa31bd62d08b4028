/**
 * The opacity curve over the histogram.
 * @typedef {import("../types.js").Histogram} Histogram
 * @typedef {import("../types.js").OpacityPoint} OpacityPoint
 * @typedef {import("./scales.js").OpacityScale} OpacityScale
 * @typedef {import("../transfer.js").Range} Range
 * @typedef {import("./scales.js").Scales} Scales
 * @typedef {import("../types.js").Transfer} Transfer
 * @typedef {"linear" | "log"} CountScale
 * @typedef {{value: number, opacity: number}} Place
 */
import { useRef } from "preact/hooks";
import { follow, useSize, useWheel } from "../browser.js";
import { hexOf, shortText } from "../text.js";
import { colorAt, opacityAt, withAddedPoint, withoutPoint, withPoint } from "../transfer.js";
import { kCoarse, kFine, kOpacityTicks, scalesOf, ticksOf } from "./scales.js";

/**
 * The outline of a histogram.
 * @param {Histogram} histogram @param {CountScale} scale @param {Scales} scales
 * @returns {string} the path of an SVG
 */
function histogramPath({ low, high, counts }, scale, scales) {
  const height = (/** @type {number} */ count) => (scale === "log" ? Math.log1p(count) : count);
  const most = height(Math.max(...counts)) || 1;
  const bottom = scales.top + scales.height;
  const edge = (/** @type {number} */ bin) => scales.x(low + ((high - low) * bin) / counts.length).toFixed(1);
  const top = (/** @type {number} */ count) => (bottom - (height(count) / most) * scales.height).toFixed(1);
  const steps = counts.map((count, bin) => `V${top(count)}H${edge(bin + 1)}`);
  return `M${edge(0)},${bottom}${steps.join("")}V${bottom}Z`;
}

const kPixelsApart = 2; // places at which the curve is evaluated

/** The opacity curve as a path. @param {OpacityPoint[]} curve @param {Scales} scales */
function curvePath(curve, scales) {
  const count = Math.ceil(scales.width / kPixelsApart);
  const even = Array.from({ length: count + 1 }, (_, i) => scales.low + ((scales.high - scales.low) * i) / count);
  const own = curve.map((p) => p[0]).filter((x) => x >= scales.low && x <= scales.high);
  const values = [...even, ...own].sort((a, b) => a - b);
  return values.map((v, i) => `${i ? "L" : "M"}${scales.x(v).toFixed(1)},${scales.y(opacityAt(curve, v)).toFixed(1)}`).join("");
}

/** The area below a curve. @param {string} path @param {Scales} scales */
function areaBelow(path, scales) {
  const bottom = scales.top + scales.height;
  return `${path}L${scales.left + scales.width},${bottom}L${scales.left},${bottom}Z`;
}

const kPixelsPerTick = 70;

/** Both axes with their ticks. @param {{scales: Scales, opacityScale: OpacityScale}} props */
function Axes({ scales, opacityScale }) {
  const { left, top, width, height, low, high } = scales;
  const values = ticksOf([low, high], Math.max(2, Math.floor(width / kPixelsPerTick)));
  return (
    <g class="axes" aria-hidden="true">
      {kOpacityTicks[opacityScale].map((opacity) => (
        <g key={opacity}>
          <line x1={left} x2={left + width} y1={scales.y(opacity)} y2={scales.y(opacity)} />
          <text x={left - 6} y={scales.y(opacity)} dy="0.32em" text-anchor="end">{opacity}</text>
        </g>
      ))}
      {values.map((value) => (
        <g key={value}>
          <line class="tick" x1={scales.x(value)} x2={scales.x(value)} y1={top + height} y2={top + height + 4} />
          <text x={scales.x(value)} y={top + height + 16} text-anchor="middle">{shortText(value)}</text>
        </g>
      ))}
    </g>
  );
}

/** @param {KeyboardEvent} event */
function directionOf({ key }) {
  return { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[key];
}

/**
 * A point of the opacity curve.
 * @param {object} props
 * @param {Transfer} props.transfer
 * @param {number} props.index
 * @param {boolean} props.selected
 * @param {Scales} props.scales
 * @param {() => void} props.onSelect
 * @param {(value: number, opacity: number) => void} props.onMove
 * @param {() => void} props.onRemove
 */
function CurvePoint({ transfer, index, selected, scales, onSelect, onMove, onRemove }) {
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

/**
 * Adds points where the diagram is pressed.
 * @param {(event: MouseEvent) => Place} placeOf
 * @param {(place: Place) => (place: Place) => void} onAdd  adds a point; what it returns moves the point
 */
function useAdding(placeOf, onAdd) {
  const pointerType = useRef("");
  const onPointerDown = (/** @type {PointerEvent} */ event) => {
    pointerType.current = event.pointerType;
    // A finger may want to scroll: it adds a point when it is lifted at the same place.
    if (event.button !== 0 || event.pointerType === "touch") return;
    const move = onAdd(placeOf(event));
    follow(event, (e) => move(placeOf(e)));
  };
  const onClick = (/** @type {MouseEvent} */ event) => {
    if (pointerType.current === "touch") onAdd(placeOf(event));
  };
  return { onPointerDown, onClick };
}

const kStops = 48; // of the gradient below the curve

/** @param {{transfer: Transfer, scales: Scales}} props */
function Gradient({ transfer, scales: { left, width, low, high } }) {
  const shares = Array.from({ length: kStops + 1 }, (_, i) => i / kStops);
  return (
    <linearGradient id="curve-colors" gradientUnits="userSpaceOnUse" x1={left} x2={left + width} y1="0" y2="0">
      {shares.map((s) => <stop key={s} offset={s} stop-color={hexOf(colorAt(transfer, low + s * (high - low)))} />)}
    </linearGradient>
  );
}

/**
 * A curve with a point elsewhere.
 * @param {OpacityPoint[]} points @param {number} index
 * @param {number} value @param {number} opacity
 */
function withMoved(points, index, value, opacity) {
  const [, , midpoint, sharpness] = points[index];
  return withPoint(points, index, [value, opacity, midpoint, sharpness]);
}

/**
 * What is behind the points.
 * @param {object} props
 * @param {Transfer} props.transfer
 * @param {Scales} props.scales
 * @param {Histogram | null} props.histogram
 * @param {CountScale} props.countScale
 */
function Curve({ transfer, scales, histogram, countScale }) {
  const path = curvePath(transfer.opacity, scales);
  return (
    <g clip-path="url(#plot-inside)">
      {histogram && <path class="histogram" d={histogramPath(histogram, countScale, scales)} />}
      <path class="area" d={areaBelow(path, scales)} fill="url(#curve-colors)" />
      <path class="curve-back" d={path} /><path class="curve" d={path} />
    </g>
  );
}

/**
 * The opacity curve over the histogram.
 * @param {object} props
 * @param {Transfer} props.transfer
 * @param {Histogram | null} props.histogram
 * @param {Range} props.shown  values at the ends of the axis
 * @param {CountScale} props.countScale
 * @param {OpacityScale} props.opacityScale
 * @param {number} props.selected
 * @param {(index: number) => void} props.onSelect
 * @param {(opacity: OpacityPoint[], moving: boolean) => void} props.onChange
 * @param {(factor: number, value: number) => void} props.onZoom  about a value
 */
export function Plot({ transfer, histogram, shown, countScale, opacityScale, selected, onSelect, onChange, onZoom }) {
  const { ref, size } = useSize();
  const scales = scalesOf(size, shown, opacityScale);
  const placeOf = (/** @type {MouseEvent} */ event) => {
    const { left, top } = ref.current.getBoundingClientRect();
    return { value: scales.valueAt(event.clientX - left), opacity: scales.opacityAt(event.clientY - top) };
  };
  useWheel(ref, (/** @type {WheelEvent} */ event) => onZoom(Math.exp(-event.deltaY / 500), placeOf(event).value));
  const points = transfer.opacity;
  const remove = (/** @type {number} */ index) => {
    if (points.length < 2) return;
    onChange(withoutPoint(points, index), false);
    onSelect(Math.min(index, points.length - 2));
  };
  const add = (/** @type {Place} */ { value, opacity }) => {
    const added = withAddedPoint(points, [value, opacity, 0.5, 0]);
    onSelect(added.index);
    onChange(added.points, true);
    return (/** @type {Place} */ to) =>
      onChange(withMoved(added.points, added.index, to.value, to.opacity), true);
  };
  const adding = useAdding(placeOf, add);
  return (
    <svg ref={ref} class="plot" role="group" aria-label="Opacity curve over the histogram" {...adding}>
      <defs>
        <Gradient transfer={transfer} scales={scales} />
        <clipPath id="plot-inside"><rect x={scales.left} y={0} width={scales.width} height={scales.top + scales.height} /></clipPath>
      </defs>
      <rect class="paper" x={scales.left} y={scales.top} width={scales.width} height={scales.height} />
      <Axes scales={scales} opacityScale={opacityScale} />
      <Curve transfer={transfer} scales={scales} histogram={histogram} countScale={countScale} />
      {points.map(([value], index) => value >= scales.low && value <= scales.high && (
        <CurvePoint
          key={index} transfer={transfer} index={index} selected={index === selected} scales={scales}
          onSelect={() => onSelect(index)} onRemove={() => remove(index)}
          onMove={(v, opacity) => onChange(withMoved(points, index, v, opacity), true)}
        />
      ))}
    </svg>
  );
}
