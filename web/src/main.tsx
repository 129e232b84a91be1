import "./styles/tokens.css";
import "./styles/base.css";
import "./styles/shell.css";
import "./styles/header.css";
import "./styles/monitors.css";
import "./styles/messages.css";
import "./styles/timeline.css";

import { StrictMode } from "react";
import { createRoot } from "react-dom/client";

import { App } from "./shell/App";
import { connect } from "./store/store";
import { start_theme } from "./widgets/theme";

start_theme();
connect();

/** Texts are fitted into nodes by their width in the page's own font: it is waited for, if it comes soon. */
const kFontWait_ms = 500;
const font = document.fonts.load('600 13px "Inter Variable"').catch(() => null);

const root = document.getElementById("root");
void Promise.race([font, new Promise((done) => setTimeout(done, kFontWait_ms))]).then(() => {
  if (!root) return;
  createRoot(root).render(
    <StrictMode>
      <App />
    </StrictMode>,
  );
});
