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
const root = document.getElementById("root");
if (root) {
  createRoot(root).render(
    <StrictMode>
      <App />
    </StrictMode>,
  );
}
