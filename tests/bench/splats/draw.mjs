// node draw.mjs FOLDER BROWSER VIEW.json OUT.png: draws a file of splats in FOLDER with Spark in a browser without a window.
// FOLDER has node_modules with @sparkjsdev/spark, three and playwright-core.
import fs from "node:fs";
import http from "node:http";
import {createRequire} from "node:module";
import path from "node:path";
import {fileURLToPath} from "node:url";

const [folder, executablePath, view, out] = process.argv.slice(2);
const {chromium} = createRequire(path.join(folder, "package.json"))("playwright-core");
const page = path.join(path.dirname(fileURLToPath(import.meta.url)), "page.html");
const types = {".html": "text/html", ".js": "text/javascript", ".wasm": "application/wasm"};

const server = http.createServer((request, response) => {
  const name = decodeURIComponent(request.url.split("?")[0]);
  const file = name === "/page.html" ? page : path.join(folder, name);
  if (!fs.existsSync(file)) return response.writeHead(404).end();
  response.writeHead(200, {"content-type": types[path.extname(file)] ?? "application/octet-stream"});
  fs.createReadStream(file).pipe(response);
});
await new Promise(resolve => server.listen(0, "127.0.0.1", resolve));
const browser = await chromium.launch(
    {executablePath, args: ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]});
try {
  const tab = await browser.newPage({viewport: {width: 512, height: 512}});
  const query = encodeURIComponent(JSON.stringify(JSON.parse(fs.readFileSync(view))));
  await tab.goto(`http://127.0.0.1:${server.address().port}/page.html?${query}`);
  await tab.waitForFunction("window.isDone", null, {timeout: 120000});
  const picture = await tab.evaluate(() => document.getElementById("canvas").toDataURL("image/png"));
  fs.writeFileSync(out, Buffer.from(picture.split(",")[1], "base64"));
} finally {
  await browser.close();
  server.close();
}
