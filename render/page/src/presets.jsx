/**
 * Opens and saves ParaView's presets.
 * @typedef {import("./types.js").Backend} Backend
 * @typedef {import("./types.js").Preset} Preset
 * @typedef {import("./transfer.js").Range} Range
 * @typedef {import("./types.js").Transfer} Transfer
 * @typedef {{name: string, presets: Preset[], index: number, ownRange: boolean, before: Range}} Opened
 *   A file that was opened; `before` is the range that was shown then.
 * @typedef {ReturnType<typeof usePresets>} OpenedPresets
 */
import { useRef, useState } from "preact/hooks";
import { saveText } from "./browser.js";
import { SegmentedField, SelectField } from "./controls.jsx";
import { paraViewText } from "./paraview.js";
import { rangeOf, withRange } from "./transfer.js";

/**
 * Buttons that open and save presets.
 * @param {{backend: Backend, transfer: Transfer, name: string, onOpen: (file: File) => void}} props
 */
export function PresetFiles({ backend, transfer, name, onOpen }) {
  const input = useRef(/** @type {any} */ (null));
  const onFile = () => {
    const [file] = input.current.files;
    if (file) onOpen(file);
    input.current.value = ""; // so that the same file can be opened again
  };
  return (
    <>
      {backend.can.has("preset") && (
        <>
          <button
            type="button" onClick={() => input.current.click()}
            title="Colors and opacities from a ParaView file (JSON or XML). Dropping the file onto the page does the same."
          >
            Open preset…
          </button>
          <input ref={input} type="file" accept=".json,.xml" hidden aria-label="ParaView preset" onChange={onFile} />
        </>
      )}
      <button
        type="button" title="Save colors and opacities as a ParaView preset (JSON)"
        onClick={() => saveText(paraViewText(transfer, name), `${name}.json`, "application/json")}
      >
        Save preset
      </button>
    </>
  );
}

/** @param {Opened} opened @returns {Transfer} */
function transferOf({ presets, index, ownRange, before }) {
  const { transfer } = presets[index];
  return ownRange ? transfer : withRange(transfer, before);
}

/**
 * What is shown of a file that was opened. As in ParaView, a preset covers the range that was shown
 * before, unless its own is wanted.
 * @param {{opened: Opened, onChange: (opened: Opened) => void}} props
 */
export function PresetChoice({ opened, onChange }) {
  const { name, presets, index, ownRange } = opened;
  return (
    <fieldset class="preset-choice">
      <legend>Preset from {name}</legend>
      {presets.length > 1 && (
        <SelectField
          label="Preset of the file" value={String(index)} options={presets.map((p, i) => [String(i), p.name])}
          onChange={(value) => onChange({ ...opened, index: Number(value) })}
        />
      )}
      <SegmentedField
        label="Range of values" value={ownRange ? "own" : "before"} options={[["before", "As before"], ["own", "Of the preset"]]}
        onChange={(value) => onChange({ ...opened, ownRange: value === "own" })}
      />
    </fieldset>
  );
}

/**
 * Opens presets, also those that are dropped onto the page.
 * @param {Backend} backend @param {() => Transfer} present @param {(transfer: Transfer) => void} onTransfer
 * @param {(text: string) => void} onMessage
 */
export function usePresets(backend, present, onTransfer, onMessage) {
  const [opened, setOpened] = useState(/** @type {Opened | null} */ (null));
  const [over, setOver] = useState(false);
  const show = (/** @type {Opened} */ next) => {
    setOpened(next);
    onTransfer(transferOf(next));
    onMessage(`The preset "${next.presets[next.index].name}" is shown.`);
  };
  const open = async (/** @type {File} */ file) => {
    try {
      const presets = await backend.preset(await file.text());
      show({ name: file.name, presets, index: 0, ownRange: false, before: rangeOf(present()) });
    } catch (error) {
      onMessage(`${file.name}: ${/** @type {Error} */ (error).message}`);
    }
  };
  const drag = (/** @type {boolean} */ inside) => (/** @type {DragEvent} */ event) => {
    if (!backend.can.has("preset") || !event.dataTransfer?.types.includes("Files")) return;
    event.preventDefault();
    setOver(inside);
  };
  const onDrop = (/** @type {DragEvent} */ event) => {
    drag(false)(event);
    const file = event.dataTransfer?.files[0];
    if (file && backend.can.has("preset")) open(file);
  };
  const dropProps = { onDragOver: drag(true), onDragLeave: drag(false), onDrop, "data-dropping": over || undefined };
  return { open, opened, show, dropProps };
}
