import { useEffect, useRef } from "preact/hooks";
import { hexOf } from "../look/css-color.js";
import { colorAt, withAddedPoint, withPoint, withoutPoint } from "../look/transfer.js";
import { follow } from "../parts/drag.js";
import { useSize } from "../parts/use-size.js";
import { Axes } from "./axes.jsx";
import { CurvePoint } from "./curve-point.jsx";
import { areaBelow, curvePath } from "./curve-path.js";
import { histogramPath } from "./histogram-path.js";
import { scalesOf } from "./scales.js";

const kStops = 48; // of the gradient below the curve

/** @param {{transfer: import("../types.js").Transfer, scales: import("./scales.js").Scales}} props */
function Gradient({ transfer, scales: { left, width, low, high } }) {
  const shares = Array.from({ length: kStops + 1 }, (_, i) => i / kStops);
  return (
    <linearGradient id="curve-colors" gradientUnits="userSpaceOnUse" x1={left} x2={left + width} y1="0" y2="0">
      {shares.map((s) => <stop key={s} offset={s} stop-color={hexOf(colorAt(transfer, low + s * (high - low)))} />)}
    </linearGradient>
  );
}

/** Calls back for turns of the wheel with Ctrl, as which trackpads send pinches. Others scroll the panel. */
function useWheel(ref, onWheel) {
  useEffect(() => {
    const listen = (/** @type {WheelEvent} */ event) => {
      if (!event.ctrlKey && !event.metaKey) return;
      event.preventDefault();
      onWheel(event);
    };
    ref.current.addEventListener("wheel", listen, { passive: false });
    return () => ref.current?.removeEventListener("wheel", listen);
  });
}

/**
 * The opacity curve over the histogram.
 * @param {object} props
 * @param {import("../types.js").Transfer} props.transfer
 * @param {import("../types.js").Histogram | null} props.histogram
 * @param {import("../look/transfer.js").Range} props.shown  values at the ends of the axis
 * @param {import("./histogram-path.js").CountScale} props.countScale
 * @param {import("./scales.js").OpacityScale} props.opacityScale
 * @param {number} props.selected
 * @param {(index: number) => void} props.onSelect
 * @param {(opacity: import("../types.js").OpacityPoint[], moving: boolean) => void} props.onChange
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
  const move = (/** @type {typeof points} */ from, /** @type {number} */ index) =>
    (/** @type {number} */ value, /** @type {number} */ opacity) => {
      const [, , midpoint, sharpness] = from[index];
      onChange(withPoint(from, index, [value, opacity, midpoint, sharpness]), true);
    };
  const remove = (/** @type {number} */ index) => {
    if (points.length < 2) return;
    onChange(withoutPoint(points, index), false);
    onSelect(Math.min(index, points.length - 2));
  };
  const add = (/** @type {MouseEvent} */ event) => {
    const { value, opacity } = placeOf(event);
    const added = withAddedPoint(points, [value, opacity, 0.5, 0]);
    onSelect(added.index);
    onChange(added.points, true);
    return added;
  };
  const pointerType = useRef("");
  const onPointerDown = (/** @type {PointerEvent} */ event) => {
    pointerType.current = event.pointerType;
    // A finger may want to scroll: it adds a point when it is lifted at the same place.
    if (event.button !== 0 || event.pointerType === "touch") return;
    const added = add(event);
    follow(event, (e) => {
      const to = placeOf(e);
      move(added.points, added.index)(to.value, to.opacity);
    });
  };
  const onClick = (/** @type {MouseEvent} */ event) => void (pointerType.current === "touch" && add(event));
  const path = curvePath(points, scales);
  return (
    <svg ref={ref} class="plot" role="group" aria-label="Opacity curve over the histogram" onPointerDown={onPointerDown} onClick={onClick}>
      <defs>
        <Gradient transfer={transfer} scales={scales} />
        <clipPath id="plot-inside"><rect x={scales.left} y={0} width={scales.width} height={scales.top + scales.height} /></clipPath>
      </defs>
      <rect class="paper" x={scales.left} y={scales.top} width={scales.width} height={scales.height} />
      <Axes scales={scales} opacityScale={opacityScale} />
      <g clip-path="url(#plot-inside)">
        {histogram && <path class="histogram" d={histogramPath(histogram, countScale, scales)} />}
        <path class="area" d={areaBelow(path, scales)} fill="url(#curve-colors)" />
        <path class="curve-back" d={path} /><path class="curve" d={path} />
      </g>
      {points.map(([value], index) => value >= scales.low && value <= scales.high && (
        <CurvePoint
          key={index} transfer={transfer} index={index} selected={index === selected} scales={scales}
          onSelect={() => onSelect(index)} onMove={move(points, index)} onRemove={() => remove(index)}
        />
      ))}
    </svg>
  );
}
