import { useEffect } from "preact/hooks";

const kMessageMs = 6000; // that a message is shown

/**
 * What went wrong, and what was done.
 * @param {object} props
 * @param {string} props.failure  why the scene is not drawn
 * @param {string} props.message
 * @param {boolean} props.open  there is a connection
 * @param {() => void} props.onClose
 */
export function Messages({ failure, message, open, onClose }) {
  useEffect(() => {
    if (!message) return;
    const timer = setTimeout(onClose, kMessageMs);
    return () => clearTimeout(timer);
  }, [message]);
  return (
    <div class="messages">
      <div role="alert">
        {!open && <p class="message error">The connection to esvr-view has ended. The page tries to connect again.</p>}
        {open && failure && <p class="message error">{failure}</p>}
      </div>
      <div role="status">{message && <p class="message">{message}</p>}</div>
    </div>
  );
}
