/** The worker of the exported page: answers the calls of LocalBackend. */
import { Engine } from "./engine.js";

/** @type {Promise<Engine>} */
let engine;

const kCalls = {
  describe: async () => (await engine).describe(),
  fit: async (request) => (await engine).fit(request),
  histogram: async (request) => (await engine).histogram(request),
  png: async (request) => (await engine).png(request),
  draw: async (request) =>
    (await engine).draw(request, (head, canvas) => {
      const bitmap = /** @type {OffscreenCanvas} */ (canvas).transferToImageBitmap();
      postMessage({ picture: { id: head.id, last: head.last, bitmap, head } }, { transfer: [bitmap] });
    }),
};

async function answer({ number, call, request }) {
  try {
    postMessage({ number, result: await kCalls[call](request) });
  } catch (error) {
    postMessage({ number, error: error instanceof Error ? error.message : String(error) });
  }
}

onmessage = ({ data }) => {
  if (data.call !== "start") return void answer(data);
  engine = Engine.start({ ...data.request, canvas: new OffscreenCanvas(1, 1) });
  engine.catch(() => {}); // each call reports it
};
