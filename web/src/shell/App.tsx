import { lazy, Suspense, useEffect } from "react";

import { panels } from "../panels/registry";
import { useStudio } from "../store/store";
import { handle_key, useCommand, useCommands } from "../widgets/commands";
import { follow_address } from "./address";
import { Header, TravelStrip } from "./Header";
import { Help } from "./Help";
import { reset_layout, toggle_maximised, useLayout } from "../widgets/layout";
import { Notes } from "./Notes";
import { Confirm } from "../widgets/Confirm";
import { go_to, Palette, useDesigns } from "./Palette";
import { ArrangementName } from "./Panels";
import { useRunCommands } from "../widgets/run_commands";
import { toggle_theme } from "../widgets/theme";
import { ViolationStrip } from "../panels/violation/ViolationStrip";
import { WhatIf } from "./WhatIf";
import { Work } from "./Work";

/** Comes when a project is edited; who looks at a run needs nothing of it. */
const DesignView = lazy(() => import("../design/DesignView"));
/** Comes when states of files are compared. */
const CompareView = lazy(() => import("../compare/CompareView"));

/** The panel that has the focus. */
function focused_panel() {
  const id = document.activeElement?.closest(".panel")?.id.replace("panel-", "");
  return panels.find((panel) => panel.id === id)?.id;
}

export function App() {
  const known = useStudio((studio) => studio.index !== null && studio.state !== null);
  const title = useStudio((studio) => studio.hello?.title);
  const designs = useDesigns();
  const compares = useStudio((studio) => studio.hello?.compare ?? false);
  useEffect(() => {
    window.addEventListener("keydown", handle_key);
    return () => window.removeEventListener("keydown", handle_key);
  }, []);
  useEffect(() => follow_address(), []);
  useEffect(() => useCommands.setState({ space_pauses: !designs }), [designs]);
  useEffect(() => {
    document.title = compares ? "Differences – Sentree Studio" : title ? `${title} – Sentree Studio` : "Sentree Studio";
  }, [title, compares]);
  useRunCommands();
  useCommand(
    ...panels.map((panel) => ({
      id: `panel.${panel.id}`,
      title: `Go to ${panel.title}`,
      group: "Page",
      // Where one designs, digits and letters are for what is edited.
      ...(designs ? {} : { keys: [panel.key] }),
      run: () => go_to(panel.id),
    })),
    { id: "theme", title: "Light or dark", group: "Page", ...(designs ? {} : { keys: ["D"] }), run: toggle_theme },
    ...(designs
      ? []
      : [
          {
            id: "panel.fill",
            title: "Let the panel fill the page, and back",
            group: "Page",
            keys: ["X"],
            run: () => {
              const id = focused_panel() ?? useLayout.getState().maximised;
              if (id) toggle_maximised(id);
            },
          },
          { id: "layout.reset", title: "Reset the layout", group: "Page", run: reset_layout },
        ]),
  );
  return (
    <div className="studio">
      <Header />
      <TravelStrip travels={!designs && !compares} />
      {!designs && !compares && <ViolationStrip />}
      {compares ? (
        <Suspense fallback={<p className="empty waiting">Comparing …</p>}>
          <CompareView />
        </Suspense>
      ) : designs ? (
        <Suspense fallback={<p className="empty waiting">Opening the project …</p>}>
          <DesignView />
        </Suspense>
      ) : known ? (
        <Work />
      ) : (
        <p className="empty waiting">Waiting for the run …</p>
      )}
      {!designs && <Notes />}
      <Palette />
      <Help />
      <WhatIf />
      <ArrangementName />
      <Confirm />
    </div>
  );
}
