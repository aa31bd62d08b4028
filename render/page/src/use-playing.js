import { useEffect, useState } from "preact/hooks";

/**
 * Plays a sequence: the next frame comes after a time, but not before the present one was shown.
 * @param {boolean} playing
 * @param {number[]} frames
 * @param {() => number | null} frame  the present one
 * @param {{current: number | null | undefined}} shownFrame
 * @param {(frame: number) => void} onFrame
 */
export function usePlaying(playing, frames, frame, shownFrame, onFrame) {
  const [speed, setSpeed] = useState(12);
  useEffect(() => {
    if (!playing) return;
    const advance = () => {
      const present = frame();
      if (present === null || shownFrame.current !== present) return;
      onFrame(frames[(frames.indexOf(present) + 1) % frames.length]);
    };
    const timer = setInterval(advance, 1000 / speed);
    return () => clearInterval(timer);
  }, [playing, speed, frames]);
  return { speed, onSpeed: setSpeed };
}
