import { useRef, useState } from "preact/hooks";
import { extentOf, rangeOf, withRange } from "../look/transfer.js";
import { paraViewText } from "../look/paraview.js";
import { saveText } from "../parts/save-file.js";

/**
 * @typedef {import("../types.js").Backend} Backend
 * @typedef {import("../types.js").Transfer} Transfer
 * @typedef {import("../types.js").Preset} Preset
 */

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

/** Presets over 0 to 1, as most are, cover the present range. @param {Transfer} preset @param {Transfer} present */
function placed(preset, present) {
  const [low, high] = extentOf(preset.colors);
  return low === 0 && high === 1 ? withRange(preset, rangeOf(present)) : preset;
}

/**
 * Opens presets, also those that are dropped onto the page.
 * @param {Backend} backend @param {(transfer: Transfer) => void} onTransfer @param {(text: string) => void} onMessage
 */
export function useDroppedPreset(backend, onTransfer, onMessage) {
  const [presets, setPresets] = useState(/** @type {Preset[]} */ ([]));
  const [over, setOver] = useState(false);
  const take = (/** @type {Preset} */ { name, transfer }) => {
    onTransfer(transfer);
    onMessage(`The preset "${name}" is shown.`);
  };
  const open = async (/** @type {File} */ file) => {
    try {
      const found = await backend.preset(await file.text());
      setPresets(found.length > 1 ? found : []);
      take(found[0]);
    } catch (error) {
      onMessage(`${file.name}: ${/** @type {Error} */ (error).message}`);
    }
  };
  const drag = (/** @type {boolean} */ inside) => (/** @type {DragEvent} */ event) => {
    if (!event.dataTransfer?.types.includes("Files")) return;
    event.preventDefault();
    setOver(inside);
  };
  const onDrop = (/** @type {DragEvent} */ event) => {
    drag(false)(event);
    const file = event.dataTransfer?.files[0];
    if (file && backend.can.has("preset")) open(file);
  };
  const chooser = presets.length > 0 && (
    <label class="field">
      <span>Preset of the file</span>
      <select onChange={(event) => take(presets[event.currentTarget.selectedIndex])}>
        {presets.map(({ name }) => <option key={name}>{name}</option>)}
      </select>
    </label>
  );
  const dropProps = { onDragOver: drag(true), onDragLeave: drag(false), onDrop, "data-dropping": over || undefined };
  return { open, chooser, dropProps, placed };
}
