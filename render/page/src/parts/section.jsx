/**
 * A part of the panel that can be folded.
 * @param {{title: string, open?: boolean, note?: any, children: any}} props
 */
export function Section({ title, open = false, note, children }) {
  return (
    <details class="section" open={open}>
      <summary><h2>{title}</h2>{note && <span class="note">{note}</span>}</summary>
      <div class="content">{children}</div>
    </details>
  );
}
