import "./page.css";
import { LocalBackend } from "./local/backend.js";
import { contentOf } from "./local/content.js";
import { startPage } from "./app.jsx";

contentOf(document).then(
  (content) => startPage(new LocalBackend(content)),
  (error) => (document.getElementById("page") ?? document.body).replaceChildren(error.message),
);
