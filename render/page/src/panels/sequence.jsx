import { SelectField, SliderField } from "../parts/fields.jsx";
import { Icon } from "../parts/icon.jsx";

/** @type {[string, string][]} */
const kSpeeds = [["6", "6 per second"], ["12", "12 per second"], ["24", "24 per second"], ["30", "30 per second"]];

/**
 * Chooses a frame of a sequence, or plays it.
 * @param {object} props
 * @param {number[]} props.frames
 * @param {number | null} props.frame
 * @param {boolean} props.playing
 * @param {number} props.speed
 * @param {(frame: number, moving: boolean) => void} props.onFrame
 * @param {(playing: boolean) => void} props.onPlay
 * @param {(speed: number) => void} props.onSpeed
 */
export function SequenceBar({ frames, frame, playing, speed, onFrame, onPlay, onSpeed }) {
  const index = Math.max(0, frames.indexOf(frame ?? frames[0]));
  const step = (/** @type {number} */ by) => onFrame(frames[(index + by + frames.length) % frames.length], false);
  return (
    <div class="sequence" role="group" aria-label="Sequence">
      <button type="button" class="icon" aria-label="Frame before" title="Frame before" onClick={() => step(-1)}><Icon name="back" /></button>
      <button type="button" class="icon" aria-label={playing ? "Pause" : "Play"} title={playing ? "Pause" : "Play"} onClick={() => onPlay(!playing)}>
        <Icon name={playing ? "pause" : "play"} />
      </button>
      <button type="button" class="icon" aria-label="Next frame" title="Next frame" onClick={() => step(1)}><Icon name="next" /></button>
      <SliderField
        label="Frame" hideLabel value={index} min={0} max={frames.length - 1} step={1} text={`frame ${frames[index]}`}
        onChange={(i, moving) => onFrame(frames[i], moving)}
      />
      <output>Frame {frames[index]} <span class="unit">({frames[0]} to {frames[frames.length - 1]})</span></output>
      <SelectField label="Speed" hideLabel value={String(speed)} options={kSpeeds} onChange={(v) => onSpeed(Number(v))} />
    </div>
  );
}
