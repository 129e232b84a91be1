import { useState } from "react";

import { download, file_name } from "../../picture/export";
import { Icon } from "../../widgets/Icon";
import { useStudio } from "../../store/store";
import { steer } from "./steering";

/** The run so far, with everything that was done to it, as a scenario that does the same again. */
export function SaveTab() {
  const title = useStudio((studio) => studio.index?.model.scenario?.name ?? "run");
  const [name, set_name] = useState("");
  const [saved, set_saved] = useState<{ yaml: string; file: string } | null>(null);
  const wanted = name || `${title}-again`;
  return (
    <form
      className="form"
      onSubmit={(event) => {
        event.preventDefault();
        void steer("save_scenario", { name: wanted }).then(set_saved);
      }}
    >
      <p className="muted">Writes what was done to this run, and what came of it, as a scenario that repeats it.</p>
      <div className="row">
        <input className="field small grow" aria-label="Name of the scenario" placeholder={`${title}-again`} value={name} spellCheck={false} onChange={(event) => set_name(event.target.value)} data-testid="scenario-name" />
        <button type="submit" className="button small primary" data-testid="save-scenario">
          Save as scenario
        </button>
      </div>
      {saved && (
        <>
          <p role="status">
            Saved as <span className="mono wrap" data-testid="saved-file">{saved.file}</span>
          </p>
          <p className="row">
            <code className="mono outcome-line">sentree test {saved.file}</code>
            <button type="button" className="button small" onClick={() => download(saved.yaml, file_name([wanted], "yaml"), "application/yaml")}>
              <Icon name="download" />
              Download
            </button>
          </p>
          <pre className="outcome mono">{saved.yaml}</pre>
        </>
      )}
    </form>
  );
}
