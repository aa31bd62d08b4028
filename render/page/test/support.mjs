// What the browser tests share: sample files, a server, a browser, and pictures as numbers.
import assert from "node:assert/strict";
import { execFileSync, spawn } from "node:child_process";
import { existsSync, mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before } from "node:test";
import { setTimeout } from "node:timers/promises";
import { chromium } from "playwright-core";

/** Flags for pages that draw by WebGL themselves. */
export const kFlags = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--no-sandbox"];
/** Flags for pages whose server draws. A GPU in software would take a third of the time of their tests. */
const kServedFlags = ["--disable-gpu", "--renderer-process-limit=1", "--no-sandbox"];
const kStartMs = 60_000; // the machine may be busy

/** A program of the project; the build names it in the environment. */
function program(name) {
  const path = process.env[name];
  if (!path || !existsSync(path)) throw new Error(`set ${name} to the program of this name`);
  return path;
}

export function run(name, args, options = {}) {
  return execFileSync(program(name), args, { encoding: "utf8", stdio: ["ignore", "pipe", "pipe"], ...options });
}

/** Small volumes: smoke as VDB and as ellipsoids, and a sequence of three frames. */
export function makeSamples(folder) {
  const smoke = join(folder, "smoke.vdb"), fitted = join(folder, "smoke.esvr");
  run("ESVR_SAMPLE", ["plume", smoke, "--resolution", "48"]);
  run("VDB2ESVR", [smoke, fitted, "--count", "300", "--representation", "ellipsoids"]);
  const frames = join(folder, "rising.####.vdb"), sequence = join(folder, "rising.esvr");
  run("ESVR_SAMPLE", ["plume", frames, "--resolution", "32", "--frames", "3"]);
  run("VDB2ESVR", [frames, sequence]);
  return { smoke, fitted, sequence };
}

/** Starts esvr-view. \returns its address, and a function that ends it */
export function serve(files) {
  const child = spawn(program("ESVR_VIEW"), [...files, "--device", "cpu"], { stdio: ["ignore", "pipe", "inherit"] });
  const stop = () => void child.kill("SIGINT");
  return new Promise((resolve, reject) => {
    let text = "";
    child.stdout.on("data", (data) => {
      text += data;
      const found = text.match(/http:\/\/\S+/);
      if (found) resolve({ url: found[0], stop });
    });
    child.on("exit", (code) => reject(new Error(`esvr-view ended with ${code}`)));
  });
}

/** Makes samples, a server and a browser for the tests of a file. */
export function bench() {
  const shared = {};
  before(async () => {
    shared.folder = mkdtempSync(join(tmpdir(), "esvr-view-"));
    shared.files = makeSamples(shared.folder);
    const { fitted, smoke, sequence } = shared.files;
    shared.server = await serve([fitted, smoke, sequence]);
    shared.browser = await chromium.launch({ executablePath: process.env.ESVR_BROWSER ?? "/usr/bin/chromium", args: kServedFlags });
  });
  after(async () => {
    await shared.browser?.close();
    shared.server?.stop();
    rmSync(shared.folder, { recursive: true, force: true });
  });
  return shared;
}

/** An empty tab of a new context, which ends with the test. */
async function newTab(t, shared, options) {
  const context = await shared.browser.newContext(options);
  t?.after(() => context.close());
  return context.newPage();
}

/**
 * Opens the page. Errors of its script fail the test. Tests without other options share a tab, because a new one
 * takes longer than most tests; the page is loaded anew for each of them.
 */
export async function openPage(t, shared, { hash = "", url = shared.server?.url, expectErrors, ...options } = {}) {
  const viewport = shared.viewport ?? { width: 900, height: 600 };
  // Half a pixel for each of CSS: pictures have a quarter of the pixels, and nothing else is smaller.
  const all = { viewport, deviceScaleFactor: 0.5, permissions: ["clipboard-read", "clipboard-write"], ...options };
  const shares = Object.keys(options).length === 0 && !shared.taken;
  const page = shares ? (shared.tab ??= await newTab(null, shared, all)) : await newTab(t, shared, all);
  if (shares) {
    shared.taken = true;
    t.after(() => (shared.taken = false));
  }
  const errors = [];
  const onError = (error) => errors.push(error);
  const onConsole = (message) => message.type() === "error" && errors.push(new Error(message.text()));
  page.on("pageerror", onError).on("console", onConsole);
  t.after(() => {
    page.off("pageerror", onError).off("console", onConsole);
    if (errors.length > 0 && !expectErrors) throw errors[0];
  });
  if (page.url().split("#")[0] === url) {
    await page.evaluate((address) => history.replaceState(null, "", address), url + hash);
    await page.reload();
  } else await page.goto(url + hash);
  await page.locator(".viewer").waitFor({ timeout: kStartMs });
  await rested(page);
  return page;
}

/** Waits until the picture of the latest change is complete. */
export async function rested(page) {
  await page.waitForTimeout(300); // until a change counts as at rest
  await page.locator('.picture[aria-busy="false"]').waitFor({ timeout: kStartMs });
}

/** Waits until `read` gives what is expected. The page draws its controls a moment after an event. */
export async function becomes(read, expected) {
  for (const end = Date.now() + kStartMs; Date.now() < end; await setTimeout(20)) if ((await read()) === expected) return;
  assert.equal(await read(), expected);
}

/** The scene in the address. */
export function sceneOf(page) {
  const members = new URLSearchParams(new URL(page.url()).hash.slice(1));
  return Object.fromEntries([...members].map(([name, value]) => [name, JSON.parse(value)]));
}

/** Opens a section of the panel. */
export async function unfold(page, title) {
  const section = page.locator("details", { has: page.getByRole("heading", { name: title }) });
  if (!(await section.evaluate((details) => details.open))) await section.locator("summary").click();
  return section;
}

/** The bytes of a data: address, which is the fastest way from the page. */
const bytesOf = (address) => Buffer.from(address.slice(address.indexOf(",") + 1), "base64");

/** The picture as { width, height, data }, data with four bytes a pixel. */
export async function pictureOf(page) {
  const { width, height, address } = await page.evaluate(async () => {
    const canvas = document.querySelector(".surface canvas");
    const { width, height } = canvas;
    const { data } = canvas.getContext("2d").getImageData(0, 0, width, height);
    const reader = new FileReader();
    reader.readAsDataURL(new Blob([data]));
    await new Promise((resolve) => (reader.onload = resolve));
    return { width, height, address: reader.result };
  });
  return { width, height, data: bytesOf(address) };
}

/** The pixels of a PNG file, before a background. The page decodes it. */
export async function pixelsOf(page, bytes, background = "#000") {
  const { width, height, address } = await page.evaluate(async ([base64, color]) => {
    const binary = Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
    const bitmap = await createImageBitmap(new Blob([binary], { type: "image/png" }));
    const { width, height } = bitmap;
    const context = new OffscreenCanvas(width, height).getContext("2d");
    context.fillStyle = color;
    context.fillRect(0, 0, width, height);
    context.drawImage(bitmap, 0, 0);
    const reader = new FileReader();
    reader.readAsDataURL(new Blob([context.getImageData(0, 0, width, height).data]));
    await new Promise((resolve) => (reader.onload = resolve));
    return { width, height, address: reader.result };
  }, [bytes.toString("base64"), background]);
  return { width, height, data: bytesOf(address) };
}

/** Mean absolute difference of two pictures of one size, in 255ths. */
export function differenceOf(a, b) {
  if (a.width !== b.width || a.height !== b.height) throw new Error("pictures of different sizes");
  let sum = 0;
  for (let i = 0; i < a.data.length; ++i) sum += Math.abs(a.data[i] - b.data[i]);
  return sum / a.data.length;
}

/** Share of the pixels that are not black. */
export function litShare({ data }) {
  let lit = 0;
  for (let i = 0; i < data.length; i += 4) lit += Math.max(data[i], data[i + 1], data[i + 2]) > 12;
  return lit / (data.length / 4);
}

/** Does something, and tells how much the picture changed by it. */
export async function changeBy(page, act) {
  const before = await pictureOf(page);
  await act();
  await rested(page);
  return differenceOf(before, await pictureOf(page));
}
