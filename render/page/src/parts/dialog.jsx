import { useEffect, useId, useRef } from "preact/hooks";
import { Icon } from "./icon.jsx";

/** @param {{title: string, onClose: () => void, children: any}} props */
export function Dialog({ title, onClose, children }) {
  const ref = useRef(/** @type {any} */ (null));
  const id = useId();
  useEffect(() => ref.current.showModal(), []);
  const onClick = (/** @type {MouseEvent} */ event) => event.target === ref.current && onClose();
  return (
    <dialog ref={ref} aria-labelledby={id} onClose={onClose} onClick={onClick}>
      <header>
        <h2 id={id}>{title}</h2>
        <button type="button" class="icon" aria-label="Close" onClick={onClose}><Icon name="close" /></button>
      </header>
      <div class="content">{children}</div>
    </dialog>
  );
}
