import { useEffect } from "react";

import { panels } from "../panels/registry";
import { handle_key, useCommand } from "./commands";
import { go_to_panel, reset_layout } from "./layout";
import { toggle_theme } from "./theme";
import { Work } from "./Work";

export function App() {
  useEffect(() => {
    window.addEventListener("keydown", handle_key);
    return () => window.removeEventListener("keydown", handle_key);
  }, []);
  useCommand(
    ...panels.map((panel) => ({
      id: `panel.${panel.id}`,
      title: `Go to ${panel.title}`,
      group: "Page",
      keys: [panel.key],
      run: () => go_to_panel(panel.id),
    })),
    { id: "theme", title: "Light or dark", group: "Page", keys: ["D"], run: toggle_theme },
    { id: "layout.reset", title: "Reset the layout", group: "Page", run: reset_layout },
  );
  return (
    <div className="studio">
      <Work />
    </div>
  );
}
