/** Unpacks the program of the exported page and runs it. */
import { partOf } from "./packing.js";

async function start() {
  const script = document.createElement("script");
  script.src = URL.createObjectURL(new Blob([await partOf("esvr-program")], { type: "text/javascript" }));
  document.body.append(script);
}

start().catch(() => {
  const page = document.getElementById("page");
  if (page) page.textContent = "This page needs a browser of 2023 or later.";
});
