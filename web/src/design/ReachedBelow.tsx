import { useEffect, useState } from "react";

import { ReachedList } from "../panels/reached/ReachedList";
import { show_marks, state_key, transition_key, useReached } from "../panels/reached/reached";
import { kNotVerified, VerifiedNote } from "../panels/reached/VerifiedNote";
import type { NotReached, Reached } from "../protocol/types";
import { request } from "../store/store";
import { open_file, useDesign } from "./design";
import { line_start } from "./places";

/** What the shadow run, all scenarios together, or behaviours that were verified never reach, with its marks in the pictures. */
export function ReachedBelow() {
  const [whose, set_whose] = useState<"all" | "one" | "every">("all");
  const all = whose === "all";
  const [none, set_none] = useState(false);
  const [reached, set_reached] = useState<Reached | null>(null);
  const scenario = useDesign((state) => state.summary?.scenario ?? "");
  const news = useDesign(({ summary }) => (all ? `${summary?.reached_by_all}` : `${summary?.shadow.current} ${summary?.scenario}`));
  // Of a text that was edited the shadow run is another one, even where it ends at the same time.
  const version = useDesign((state) => state.summary?.files.reduce((sum, file) => sum + file.version, 0) ?? 0);
  useEffect(() => {
    let gone = false;
    void request("design_reached", { all, verification: whose === "every" }).then(
      (found) => {
        if (gone) return;
        set_none(whose === "every" && !found);
        // While the texts are run again, what was known stays.
        if (found) {
          set_reached(found);
          show_marks(found);
        }
      },
      () => undefined,
    );
    return () => {
      gone = true;
    };
  }, [all, whose, news, version]);
  useEffect(
    () => () => {
      show_marks(null);
      void request("design_reached", { all: false }).catch(() => undefined);
    },
    [],
  );
  return (
    <section className="reached-below" aria-label="Never reached">
      <label className="reached-of">
        Reached by{" "}
        <select
          className="field"
          aria-label="Whose"
          value={whose}
          onChange={(event) => {
            set_reached(null);
            set_none(false);
            set_whose(event.target.value as typeof whose);
          }}
        >
          <option value="all">all scenarios together</option>
          <option value="one">{scenario || "the mission alone"}</option>
          <option value="every">any behaviour (verified)</option>
        </select>
      </label>
      {none && <p className="empty">{kNotVerified}</p>}
      <VerifiedNote of={reached?.verification} />
      {reached ? <ReachedList reached={reached} go={(what) => void go(what)} leads={({ file, line }) => file !== "" && line > 0} /> : !none && <p className="empty">{whose === "every" ? "Looking what was reached …" : "The scenarios run …"}</p>}
    </section>
  );
}

async function go({ kind, what, file, line }: NotReached): Promise<void> {
  await open_file(file);
  const doc = useDesign.getState().docs[file];
  if (!doc) return;
  await open_file(file, doc.places.byte(line_start(doc.places.shown, line, true)));
  if (kind === "states") useDesign.setState({ state: what });
  useReached.setState({ sought: kind === "states" ? state_key(file, what) : transition_key(file, line) });
}
