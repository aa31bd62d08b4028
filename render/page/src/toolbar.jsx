import { useEffect, useState } from "preact/hooks";
import { HelpDialog } from "./help-dialog.jsx";
import { SelectField } from "./parts/fields.jsx";
import { Icon } from "./parts/icon.jsx";
import { copyText } from "./parts/save-file.js";
import { SaveDialog } from "./save-dialog.jsx";
import { applyTheme, kThemes, storedTheme } from "./theme.js";

/** Undo and redo by the usual keys, except in fields of text, which have their own. */
function useUndoKeys(store) {
  useEffect(() => {
    const listen = (/** @type {KeyboardEvent} */ event) => {
      if (!(event.ctrlKey || event.metaKey) || /** @type {Element} */ (event.target).matches("input[type=text], textarea")) return;
      const key = event.key.toLowerCase();
      if (key === "z" && !event.shiftKey) store.undo();
      else if (key === "y" || key === "z") store.redo();
      else return;
      event.preventDefault();
    };
    addEventListener("keydown", listen);
    return () => removeEventListener("keydown", listen);
  }, []);
}

/** @param {{label: string, icon: string, wide?: boolean, disabled?: boolean, onClick: () => void}} props */
const Tool = ({ label, icon, wide, disabled, onClick }) => (
  <button type="button" class={wide ? "tool wide" : "tool"} aria-label={label} title={label} disabled={disabled} onClick={onClick}>
    <Icon name={icon} />{wide && <span>{label}</span>}
  </button>
);

function ThemeTool() {
  const [theme, setTheme] = useState(storedTheme);
  const next = kThemes[(kThemes.indexOf(/** @type {any} */ (theme)) + 1) % kThemes.length];
  return <Tool label={`Theme: ${theme}. Change to ${next}`} icon="theme" onClick={() => (applyTheme(next), setTheme(next))} />;
}

/**
 * @param {object} props
 * @param {import("./types.js").Backend} props.backend
 * @param {import("./types.js").Description} props.description
 * @param {import("./state/store.js").Store} props.store
 * @param {{width: number, height: number}} props.pixels
 * @param {(file: number, grid: number) => void} props.onGrid
 * @param {(text: string) => void} props.onMessage
 */
export function Toolbar({ backend, description, store, pixels, onGrid, onMessage }) {
  const [dialog, setDialog] = useState("");
  useUndoKeys(store);
  const { scene } = store;
  const grids = description.files.flatMap(({ name, grids: all }, f) =>
    all.map((grid, g) => /** @type {[string, string]} */ ([`${f}/${g}`, `${name}: ${grid.name}`])));
  const choose = (/** @type {string} */ key) => onGrid(.../** @type {[number, number]} */ (key.split("/").map(Number)));
  const copyLink = async () =>
    onMessage((await copyText(location.href)) ? "The link to this view is on the clipboard." : "The address of this page is the link to this view.");
  const close = () => setDialog("");
  const { files } = description;
  return (
    <header class="toolbar">
      <h1>ESVR<span> viewer</span></h1>
      <div class="grids">
        <SelectField label="Volume" hideLabel value={`${scene.file}/${scene.grid}`} options={grids} onChange={choose} />
      </div>
      <span class="space" />
      <div class="tools" role="toolbar" aria-label="Tools">
        <Tool label="Undo" icon="undo" disabled={!store.canUndo} onClick={() => store.undo()} />
        <Tool label="Redo" icon="redo" disabled={!store.canRedo} onClick={() => store.redo()} />
        <Tool label="Copy link" icon="link" wide onClick={copyLink} />
        {(backend.can.has("png") || backend.can.has("command")) && (
          <Tool label="Save picture" icon="save" wide onClick={() => setDialog("save")} />
        )}
        <ThemeTool />
        <Tool label="Help" icon="help" onClick={() => setDialog("help")} />
      </div>
      {dialog === "save" && (
        <SaveDialog backend={backend} scene={scene} pixels={pixels} name={files[scene.file].name.replace(/\.\w+$/, "")} onClose={close} onMessage={onMessage} />
      )}
      {dialog === "help" && <HelpDialog onClose={close} />}
    </header>
  );
}
