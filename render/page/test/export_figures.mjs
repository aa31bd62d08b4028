// Measures exported pages: `node test/export_figures.mjs FILE.esvr...` with ESVR_VIEW, ESVR_RENDER and
// ESVR_BROWSER in the environment. For each file it prints the size of the page, the time until its first
// complete picture, the difference of a picture of 512 x 512 from that of esvr-render, the pictures per
// second while a mouse turns the volume for five seconds (the page draws smaller ones where that takes
// long), and the time of a picture of 512 x 512 during a drag, without the page around it. The processor time
// of such a picture does not depend on what else the machine does.
import { mkdtempSync, readFileSync, rmSync, statSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { basename, join, resolve } from "node:path";
import { fileURLToPath, pathToFileURL } from "node:url";
import { build } from "esbuild";
import { chromium } from "playwright-core";
import { differenceOf, kFlags, pictureOf, pixelsOf, rested, run } from "./support.mjs";

const kSide = 512, kDragMs = 5000, kTurn = 24;
const kHash = "#background=" + encodeURIComponent("[0,0,0]");

/** Counts the pictures that the page shows. */
function countPictures() {
  globalThis.shown = [];
  const draw = CanvasRenderingContext2D.prototype.drawImage;
  CanvasRenderingContext2D.prototype.drawImage = function (...all) {
    if (this.canvas.closest?.(".surface")) globalThis.shown.push([performance.now(), all[0].width]);
    return draw.apply(this, all);
  };
}

/** Makes the picture of the page a square. */
async function resize(page) {
  for (let i = 0; i < 12; ++i) {
    const box = await page.locator(".surface").boundingBox(), { width, height } = page.viewportSize();
    await page.setViewportSize({ width: width + kSide - Math.round(box.width), height: height + kSide - Math.round(box.height) });
    await page.waitForTimeout(200);
  }
  await rested(page);
}

/** Turns the volume by the mouse as fast as the page takes moves. */
async function drag(page) {
  const box = await page.locator(".surface").boundingBox();
  const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
  await page.evaluate(() => void (globalThis.shown.length = 0));
  await page.mouse.move(x, y);
  await page.mouse.down();
  const end = Date.now() + kDragMs;
  for (let i = 1; Date.now() < end; ++i) await page.mouse.move(x + 200 * Math.sin(i / 40), y + 20 * Math.sin(i / 90));
  const shown = await page.evaluate(() => globalThis.shown);
  await page.mouse.up();
  const widths = shown.map(([, width]) => width).sort((a, b) => a - b);
  return { perSecond: ((shown.length - 1) * 1000) / (shown.at(-1)[0] - shown[0][0]), width: widths[widths.length >> 1] };
}

/** The picture of the command that the page shows. */
async function ofCommand(page, file, folder) {
  await page.getByRole("button", { name: "Save picture" }).click();
  const text = await page.getByRole("textbox", { name: "Command" }).inputValue();
  const [download] = await Promise.all([page.waitForEvent("download"), page.getByRole("button", { name: /transfer\.json/ }).click()]);
  writeFileSync(join(folder, "transfer.json"), readFileSync(await download.path()));
  await page.getByRole("button", { name: "Close" }).click();
  const words = text.match(/'[^']*'|\S+/g).map((word) => word.replace(/^'|'$/g, ""));
  run("ESVR_RENDER", [file, ...words.slice(2), "--force", "--device", "cpu"], { cwd: folder });
  return pixelsOf(page, readFileSync(join(folder, "picture.png")));
}

/** The module that draws, as a script of its own. */
async function engineScript() {
  const contents = 'import { Engine } from "./src/local/engine.js"; globalThis.Engine = Engine;';
  const resolveDir = fileURLToPath(new URL("..", import.meta.url));
  const { outputFiles } = await build({ stdin: { contents, resolveDir }, bundle: true, format: "iife", write: false });
  return outputFiles[0].text;
}

/** Draws pictures of a turn as a drag does. \returns the median of their times in milliseconds */
function turn([file, wasm, side, count]) {
  const bytes = (base64) => Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
  const scene = { grid: 0, opacityLength: 1, step: 1, mode: "composite", classification: "pre", shade: false, lod: "auto", background: null, clip: null, slice: null };
  const start = async () => {
    const engine = await Engine.start({ name: "", file: bytes(file), wasm: bytes(wasm), canvas: new OffscreenCanvas(1, 1) });
    const { space, colors, opacity } = engine.describe().files[0].grids[0].defaultLook;
    const camera = engine.fit({ grid: 0, view: "default", orthographic: false, width: side, height: side });
    const [x, , z] = camera.eye.map((v, i) => v - camera.center[i]), times = [];
    for (let i = 0; i <= count; ++i) {
      const c = Math.cos((2 * Math.PI * i) / count), s = Math.sin((2 * Math.PI * i) / count);
      const eye = [camera.center[0] + x * c + z * s, camera.eye[1], camera.center[2] - x * s + z * c];
      const began = performance.now();
      const wish = { id: i, width: side, height: side, moving: true, scene: { ...scene, camera: { ...camera, eye }, transfer: { space, colors, opacity } } };
      await engine.draw(wish, (_, canvas) => canvas.transferToImageBitmap().close());
      if (i > 0) times.push(performance.now() - began);
    }
    return times.sort((a, b) => a - b)[count >> 1];
  };
  return start();
}

/** Processor time of the process that runs WebGL, in milliseconds. */
async function graphicsMs(browser) {
  const devtools = await browser.newBrowserCDPSession();
  const { processInfo } = await devtools.send("SystemInfo.getProcessInfo");
  return 1000 * processInfo.filter(({ type }) => type === "GPU").reduce((sum, { cpuTime }) => sum + cpuTime, 0);
}

async function timeOfPicture(browser, file) {
  const page = await browser.newPage();
  await page.addScriptTag({ content: await engineScript() });
  const wasm = readFileSync(new URL("../decoder.wasm", import.meta.url)).toString("base64");
  const content = [readFileSync(file).toString("base64"), wasm, kSide];
  await page.evaluate(turn, [...content, 2]); // compiles the shaders
  const before = await graphicsMs(browser), ms = await page.evaluate(turn, [...content, kTurn]);
  const processorMs = ((await graphicsMs(browser)) - before) / (kTurn + 1);
  await page.close();
  return { ms, processorMs };
}

async function measure(browser, file, folder) {
  const html = join(folder, basename(file).replace(/\.\w+$/, ".html"));
  run("ESVR_VIEW", ["--export", html, file]);
  const page = await browser.newPage({ viewport: { width: 900, height: 600 } });
  await page.addInitScript(countPictures);
  const began = Date.now();
  await page.goto(pathToFileURL(html).href + kHash);
  await page.waitForFunction(() => globalThis.shown?.length > 0, null, { timeout: 60_000 });
  const firstMs = Date.now() - began;
  await rested(page);
  await resize(page);
  const picture = await pictureOf(page), reference = await ofCommand(page, file, folder);
  const { perSecond, width } = await drag(page);
  const { ms, processorMs } = await timeOfPicture(browser, file);
  console.log(
    `${basename(file)}: ${statSync(html).size} bytes, first picture after ${firstMs} ms, ` +
      `${picture.width} x ${picture.height}: mean difference ${differenceOf(picture, reference).toFixed(3)} / 255, ` +
      `${perSecond.toFixed(1)} pictures per second while dragging (half of them at least ${width} pixels wide), ` +
      `${ms.toFixed(0)} ms (processor time ${processorMs.toFixed(0)} ms) for a picture of a drag of ${kSide} x ${kSide}`,
  );
  await page.close();
}

const folder = mkdtempSync(join(tmpdir(), "esvr-figures-"));
const browser = await chromium.launch({ executablePath: process.env.ESVR_BROWSER ?? "/usr/bin/chromium", args: kFlags });
for (const file of process.argv.slice(2)) await measure(browser, resolve(file), folder);
await browser.close();
rmSync(folder, { recursive: true, force: true });
