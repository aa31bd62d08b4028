import { Dialog } from "./parts/dialog.jsx";

const kHelp = [
  ["In the picture", [
    ["Drag, or one finger", "turn"],
    ["Shift and drag, right button, or two fingers", "shift"],
    ["Wheel, or pinch", "zoom"],
    ["Double click, or 0", "show all of the volume"],
    ["Arrow keys", "turn"],
    ["Shift and arrow keys", "shift"],
    ["+ and −", "zoom"],
  ]],
  ["In the opacity curve", [
    ["Click", "add a point"],
    ["Drag, or arrow keys", "move a point; with Shift, arrow keys make finer steps"],
    ["Delete, or right click", "remove a point"],
    ["Ctrl and wheel", "zoom the axis of values"],
  ]],
  ["Everywhere", [
    ["Ctrl+Z, Ctrl+Shift+Z", "undo and redo a change of settings"],
    ["Drop a file", "show a ParaView preset (JSON or XML)"],
    ["The address of the page", "reproduces the view: bookmark it or send it"],
  ]],
];

/** @param {{onClose: () => void}} props */
export function HelpDialog({ onClose }) {
  return (
    <Dialog title="Mouse, touch and keys" onClose={onClose}>
      {kHelp.map(([title, rows]) => (
        <section key={String(title)}>
          <h3>{title}</h3>
          <dl class="facts">
            {/** @type {string[][]} */ (rows).map(([what, does]) => <div key={what}><dt>{what}</dt><dd>{does}</dd></div>)}
          </dl>
        </section>
      ))}
    </Dialog>
  );
}
