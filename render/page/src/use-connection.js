import { useEffect, useState } from "preact/hooks";

/**
 * Whether there is a connection, and how many there were before.
 * @param {import("./types.js").Backend} backend
 */
export function useConnection(backend) {
  const [state, setState] = useState({ open: true, count: 0 });
  useEffect(() => {
    backend.onConnection((open) => setState((old) => ({ open, count: old.count + (open && !old.open ? 1 : 0) })));
  }, []);
  return state;
}
