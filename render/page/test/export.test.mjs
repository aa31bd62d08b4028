// The exported page: it opens from file:// without any other file, and its pictures are those of
// esvr-render.
import assert from "node:assert/strict";
import { copyFileSync, mkdtempSync, readFileSync, rmSync, statSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { chromium } from "playwright-core";
import { tmpdir } from "node:os";
import { pathToFileURL } from "node:url";
import { changeBy, differenceOf, kFlags, litShare, openPage, pictureOf, pixelsOf, rested, run, sceneOf, unfold } from "./support.mjs";

/** Largest mean difference from esvr-render, in 255ths. */
const kAgrees = 0.5;
const kVisible = 0.2;
/** The page draws in software here: its pictures are small. */
const shared = { viewport: { width: 840, height: 330 } };

/** A page with a file in it. */
function exported(file) {
  const page = file.replace(/\.\w+$/, ".html");
  run("ESVR_VIEW", ["--export", page, file, "--force"]);
  return page;
}

/** Volumes as ellipsoids, as voxels, a level set, and voxels of which some are NaN or infinite. */
function makeVolumes(folder) {
  const volume = (kind, name, ...options) => {
    const vdb = join(folder, `${name}.vdb`), file = join(folder, `${name}.esvr`);
    run("ESVR_SAMPLE", [kind, vdb, "--resolution", "32"]);
    run("VDB2ESVR", [vdb, file, ...options]);
    return file;
  };
  const missing = join(folder, "missing.esvr");
  copyFileSync(new URL("../../../tests/format/golden/non_finite.esvr", import.meta.url), missing);
  return {
    missing,
    ellipsoids: volume("plume", "plume", "--count", "300", "--representation", "ellipsoids"),
    voxels: volume("tree", "tree", "--lossless"),
    surface: volume("levelset", "surface", "--psnr", "40"),
  };
}

before(async () => {
  shared.folder = mkdtempSync(join(tmpdir(), "esvr-export-"));
  shared.files = makeVolumes(shared.folder);
  shared.browser = await chromium.launch({ executablePath: process.env.ESVR_BROWSER ?? "/usr/bin/chromium", args: kFlags });
});
after(async () => {
  await shared.browser?.close();
  rmSync(shared.folder, { recursive: true, force: true });
});

const open = (t, file, options = {}) => openPage(t, shared, { url: pathToFileURL(exported(file)).href, ...options });

/** A member of the address. */
const hash = (members) => "#" + new URLSearchParams(Object.entries(members).map(([name, value]) => [name, JSON.stringify(value)]));

/** The picture of the command that the page shows. */
async function ofCommand(page) {
  await page.getByRole("button", { name: "Save picture" }).click();
  const text = await page.getByRole("textbox", { name: "Command" }).inputValue();
  const [download] = await Promise.all([
    page.waitForEvent("download"), page.getByRole("button", { name: /transfer|preset|Save .*json/i }).first().click(),
  ]);
  writeFileSync(join(shared.folder, "transfer.json"), readFileSync(await download.path()));
  await page.getByRole("button", { name: "Close" }).click();
  const words = text.match(/'[^']*'|\S+/g).map((word) => word.replace(/^'|'$/g, ""));
  run("ESVR_RENDER", [...words.slice(1), "--force", "--device", "cpu"], { cwd: shared.folder });
  return pixelsOf(page, readFileSync(join(shared.folder, "picture.png")));
}

const kScenes = {
  "the usual look": {},
  "classified samples": { classification: "post" },
  "largest values": { mode: "maximum" },
  "mean values": { mode: "average" },
  "shaded surfaces": { shade: true },
  "a clip box": { clip: [[-1, 6, -1], [40, 20, 40]] },
  "long steps": { step: 2, opacityLength: 3 },
  "a view from far away": { camera: { eye: [400, 330, 600], center: [16, 16, 16], up: [0, 1, 0], fov: 9 } },
};
const kKinds = { ellipsoids: Object.keys(kScenes), voxels: ["the usual look", "a clip box"], surface: ["the usual look", "shaded surfaces"], missing: ["the usual look"] };
for (const [kind, names] of Object.entries(kKinds))
  for (const name of names)
    test(`${name}: the picture of ${kind} is that of esvr-render`, async (t) => {
      const page = await open(t, shared.files[kind], { hash: hash({ background: [0, 0, 0], ...kScenes[name] }) });
      const picture = await pictureOf(page);
      assert.ok(litShare(picture) > 0.005, `${litShare(picture)}`);
      assert.ok(differenceOf(picture, await ofCommand(page)) < kAgrees);
    });

test("the page asks for nothing outside itself", async (t) => {
  const context = await shared.browser.newContext();
  t.after(() => context.close());
  const page = await context.newPage(), url = pathToFileURL(exported(shared.files.ellipsoids)).href;
  const asked = [];
  page.on("request", (request) => asked.push(request.url()));
  await page.goto(url);
  await page.locator(".viewer").waitFor();
  await rested(page);
  assert.deepEqual(asked.filter((address) => address !== url && !/^(blob|data):/.test(address)), []);
});

test("most of the page is the file: the rest has at most 235,000 bytes", () => {
  const file = shared.files.voxels, base64 = 4 * Math.ceil(statSync(file).size / 3);
  assert.ok(statSync(exported(file)).size - base64 < 235_000);
});

test("a drag turns the volume, and the editor changes it", async (t) => {
  const page = await open(t, shared.files.ellipsoids);
  const box = await page.getByRole("application").boundingBox();
  const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
  const dragged = await changeBy(page, async () => {
    await page.mouse.move(x, y);
    await page.mouse.down();
    await page.mouse.move(x + 90, y + 20, { steps: 6 });
    await page.mouse.up();
  });
  assert.ok(dragged > kVisible);
  const edited = await changeBy(page, () => page.getByRole("textbox", { name: "Opacity", exact: true }).first().fill("0.9").then(() => page.keyboard.press("Enter")));
  assert.ok(edited > kVisible);
});

test("a saved picture has its size, and its pixels", async (t) => {
  const page = await open(t, shared.files.ellipsoids);
  await page.getByRole("button", { name: "Save picture" }).click();
  await page.getByRole("textbox", { name: "Width" }).fill("120");
  await page.getByRole("textbox", { name: "Height" }).fill("80");
  const [download] = await Promise.all([page.waitForEvent("download"), page.getByRole("button", { name: "Save PNG" }).click()]);
  const picture = await pixelsOf(page, readFileSync(await download.path()));
  assert.deepEqual([picture.width, picture.height], [120, 80]);
  assert.ok(litShare(picture) > 0.005);
});

test("a ParaView preset is read", async (t) => {
  const page = await open(t, shared.files.ellipsoids);
  const text = '<ColorMaps><ColorMap name="Red" space="Lab"><Point x="0" o="0" r="0" g="0" b="0"/><Point x="1" o="0.5" r="1" g="0" b="0"/></ColorMap></ColorMaps>';
  await page.getByLabel("ParaView preset").setInputFiles({ name: "red.xml", mimeType: "text/xml", buffer: Buffer.from(text) });
  await rested(page);
  assert.equal(sceneOf(page).transfer.space, "Lab");
});

test("controls that need a server are not shown", async (t) => {
  const page = await open(t, shared.files.ellipsoids);
  await unfold(page, "Rendering");
  assert.equal(await page.getByLabel("Between voxels").count(), 0);
  assert.equal(await page.getByRole("heading", { name: "Compare" }).count(), 0);
});

test("a page without a file says what is missing", async (t) => {
  const context = await shared.browser.newContext();
  t.after(() => context.close());
  const page = await context.newPage();
  await page.goto(new URL("../dist/export.html", import.meta.url).href);
  await page.getByText("This page has no file in it").waitFor();
});

test("a damaged file is refused by name", async (t) => {
  const damaged = join(shared.folder, "damaged.esvr"), bytes = readFileSync(shared.files.ellipsoids);
  bytes[bytes.length >> 1] ^= 0x10;
  writeFileSync(damaged, bytes);
  const whole = exported(shared.files.ellipsoids), text = readFileSync(whole, "utf8");
  const base64 = readFileSync(shared.files.ellipsoids).toString("base64");
  writeFileSync(whole, text.replace(base64, () => bytes.toString("base64")));
  const context = await shared.browser.newContext();
  t.after(() => context.close());
  const page = await context.newPage();
  await page.goto(pathToFileURL(whole).href);
  await page.getByText(/plume\.esvr: .*checksum/).waitFor();
});
