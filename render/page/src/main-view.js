import "./page.css";
import { ServerBackend } from "./server-backend.js";
import { startPage } from "./app.jsx";

startPage(new ServerBackend());
