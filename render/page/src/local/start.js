/** Unpacks the program of the exported page and runs it. */
async function start() {
  const packed = document.getElementById("esvr-program")?.textContent ?? "";
  const bytes = Uint8Array.from(atob(packed.trim()), (c) => c.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  const script = document.createElement("script");
  script.src = URL.createObjectURL(await new Response(stream).blob());
  document.body.append(script);
}

start().catch(() => {
  const page = document.getElementById("page");
  if (page) page.textContent = "This page needs a browser of 2023 or later.";
});
