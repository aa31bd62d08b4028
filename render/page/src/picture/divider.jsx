import { follow } from "../parts/drag.js";

const kStep = 0.02;

/**
 * The border between a volume and its reference.
 * @param {{share: number, left: string, right: string, onChange: (share: number) => void}} props
 */
export function Divider({ share, left, right, onChange }) {
  const move = (/** @type {number} */ to) => onChange(Math.min(1, Math.max(0, to)));
  const onPointerDown = (/** @type {PointerEvent} */ event) => {
    const area = /** @type {HTMLElement} */ (/** @type {HTMLElement} */ (event.currentTarget).parentElement);
    const { width, left: origin } = area.getBoundingClientRect();
    follow(event, (e) => move((e.clientX - origin) / width));
  };
  const onKeyDown = (/** @type {KeyboardEvent} */ event) => {
    const sign = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (!sign) return;
    event.preventDefault();
    move(share + sign * kStep);
  };
  return (
    <div
      class="divider" style={{ left: `${100 * share}%` }} role="slider" tabindex={0}
      aria-label="Border between the volume and the reference" aria-valuenow={Math.round(100 * share)}
      aria-valuemin={0} aria-valuemax={100} aria-valuetext={`${Math.round(100 * share)} % of the width`}
      onPointerDown={onPointerDown} onKeyDown={onKeyDown}
    >
      <span class="side before">{left}</span><span class="grip" /><span class="side after">{right}</span>
    </div>
  );
}
