import { useState } from "react";

import { download, file_name } from "../../picture/export";
import { Icon } from "../../widgets/Icon";
import { ask, useStudio } from "../../store/store";

const kNone: readonly string[] = [];

/** The run so far, with everything that was done to it, as a scenario that does the same again. */
export function SaveTab() {
  const title = useStudio((studio) => studio.index?.model.scenario?.name ?? "run");
  const scenarios = useStudio((studio) => studio.index?.model.scenarios) ?? kNone;
  const [chosen, set_into] = useState<string | null>(null);
  const into = chosen ?? (scenarios.includes(title) ? title : (scenarios[0] ?? ""));
  const [name, set_name] = useState("");
  const [saved, set_saved] = useState<{ yaml: string; file: string } | null>(null);
  const wanted = name || `${title}-again`;
  return (
    <form
      className="form"
      onSubmit={(event) => {
        event.preventDefault();
        void ask("save_scenario", { name: wanted }).then(set_saved);
      }}
    >
      <p className="muted">Writes what was done to this run, and what came of it, as a scenario that repeats it.</p>
      <div className="row">
        <input className="field small grow" aria-label="Name of the scenario" placeholder={`${title}-again`} value={name} spellCheck={false} onChange={(event) => set_name(event.target.value)} data-testid="scenario-name" />
        <button type="submit" className="button small primary" data-testid="save-scenario">
          Save as scenario
        </button>
      </div>
      {scenarios.length > 0 && (
        <div className="row">
          <select className="field small grow" aria-label="Scenario that gets what was done" value={into} onChange={(event) => set_into(event.target.value)} data-testid="scenario-into">
            {scenarios.map((one) => (
              <option key={one}>{one}</option>
            ))}
          </select>
          <button type="button" className="button small" title="What was done by hand becomes entries of its timeline, at its times; all else of the file stays" data-testid="add-to-scenario" onClick={() => void ask("add_to_scenario", { name: into }).then((done) => done && set_saved(done))}>
            Add to this scenario
          </button>
        </div>
      )}
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
