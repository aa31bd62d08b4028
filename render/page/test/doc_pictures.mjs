// Makes the pictures of docs/pictures.md: `node test/doc_pictures.mjs smoke1.esvr smoke1.vdb` with ESVR_VIEW
// in the environment, where smoke1.esvr is `vdb2esvr smoke1.vdb smoke1.esvr --ratio 50`.
import { chromium } from "playwright-core";
import { fileURLToPath } from "node:url";
import { kFlags, rested, serve, unfold } from "./support.mjs";

const kFolder = fileURLToPath(new URL("../../../docs/img/", import.meta.url));
const kTransfer = {
  space: "RGB",
  colors: [[0, 0.15, 0.2, 0.45], [1.2, 0.2, 0.6, 0.75], [2.4, 0.98, 0.85, 0.55]],
  opacity: [[0, 0, 0.5, 0], [0.4, 0.01, 0.5, 0], [1.2, 0.12, 0.5, 0], [2.4, 0.5, 0.5, 0]],
};
const kHash = "#transfer=" + encodeURIComponent(JSON.stringify(kTransfer));

async function picture(browser, url, name, colorScheme, prepare) {
  const page = await browser.newPage({ viewport: { width: 1280, height: 800 }, colorScheme });
  await page.goto(url + kHash);
  await page.locator(".viewer").waitFor();
  await prepare(page);
  await rested(page);
  await page.screenshot({ path: kFolder + name });
}

async function showEditor(page) {
  await page.getByRole("radio", { name: "Fine near 0" }).check();
  await page.getByRole("slider", { name: "Opacity point 3" }).focus();
  await page.getByRole("application").click({ position: { x: 5, y: 5 } });
  await page.evaluate(() => document.querySelector(".panel")?.scrollTo(0, 0));
}

async function showComparison(page) {
  await page.locator("summary", { hasText: "Colors" }).click();
  for (const title of ["Cut", "Compare", "Statistics"]) await unfold(page, title);
  await page.getByLabel("Reference", { exact: true }).first().selectOption({ index: 1 });
  await page.getByRole("radio", { name: "Clip box" }).check();
  const depth = page.getByRole("group", { name: "Z", exact: true }).getByLabel("to");
  await depth.fill("70");
  await depth.press("Enter");
  await page.getByRole("application").click({ position: { x: 5, y: 5 } });
}

const server = await serve(process.argv.slice(2));
const browser = await chromium.launch({ executablePath: process.env.ESVR_BROWSER ?? "/usr/bin/chromium", args: kFlags });
await picture(browser, server.url, "view_editor.png", "dark", showEditor);
await picture(browser, server.url, "view_compare.png", "light", showComparison);
await browser.close();
server.stop();
