import { clock_text } from "../draw/format";
import { MissionStatus } from "../panels/mission/MissionStatus";
import { go_to_violation } from "../panels/violation/violations";
import { MenuButton } from "../picture/PictureTools";
import type { Violation } from "../protocol/types";
import { useStudio } from "../store/store";
import { go_live, seek } from "../store/time_travel";
import { Icon } from "../widgets/Icon";
import { useWindow } from "../widgets/layout";
import { choose_part_at, choose_scenario, fix, held, open_file, show_node, tree_of, useDesign, kNoNames } from "./design";
import { show_recording, useMode } from "./mode";
import { useProblems } from "./problems";

const kSigns: Record<string, string> = { violated: "✗", satisfied: "✓", undecided: "·" };

/** The chosen scenario as it goes with what is edited: what is different from what is saved, and the verdicts. */
export function ShadowStrip() {
  const shadow = useDesign((state) => state.summary?.shadow);
  const scenario = useDesign((state) => state.summary?.scenario ?? "");
  const scenarios = useDesign((state) => state.summary?.scenarios ?? kNoNames);
  const errors = useDesign((state) => state.summary?.findings.filter(({ severity }) => severity === "error").length ?? 0);
  const empty = useDesign((state) => state.summary?.files.length === 0);
  const checked = useDesign((state) => state.summary?.checked ?? false);
  const first = shadow?.differences?.[0];
  const on_show = useMode((state) => state.runs.on_show);
  const said = () => {
    if (!shadow || empty) return "";
    if (errors > 0 && checked && !shadow.current) return shadow.ready ? "Shows the run before the errors" : "Runs when the errors are mended";
    if (shadow.problem) return shadow.problem;
    if (!shadow.current) return "Runs again …";
    if (!shadow.differences) return "As it is saved";
    if (!first) return "The same as with what is saved";
    return null;
  };
  const text = said();
  return (
    <div className="shadow-strip" data-testid="shadow" data-current={shadow?.current ?? false}>
      <label title="Runs again after each edit, with the texts as they are, saved or not">
        Shadow run{" "}
        <select className="field" aria-label="Scenario of the shadow run" value={scenario} onChange={(event) => void choose_scenario(event.target.value)}>
          <option value="">the mission alone</option>
          {scenarios.map((name) => (
            <option key={name} value={name}>
              {name}
            </option>
          ))}
        </select>
      </label>
      {on_show !== "" ? (
        <button className="difference said ellipsis" title="Show the shadow run again" onClick={() => void show_recording("")}>
          <Icon name="rewind" />
          <span className="ellipsis">
            Below and in <strong>Run</strong>: runs/{on_show}
          </span>
        </button>
      ) : text !== null ? (
        <span className="muted said ellipsis" role="status" title={text}>
          {text}
        </span>
      ) : (
        first && (
          <div className="differences">
            <button className="difference" data-testid="difference" title={`Go to the moment. ${told(first)}`} onClick={() => seek(first.time)}>
              <Icon name="follow" />
              <span className="ellipsis">
                <strong>First difference {(first.time / 1e9).toFixed(1)} s</strong> {first.who}: {first.after} <span className="muted">instead of {first.before}</span>
              </span>
            </button>
            {shadow!.differences!.length > 1 && (
              <MenuButton
                label={`All differences: +${shadow!.differences!.length - 1}`}
                data_view="differences"
                text={`+${shadow!.differences!.length - 1}`}
                entries={shadow!.differences!.map((one) => ({ label: told(one), hint: `${(one.time / 1e9).toFixed(1)} s`, run: () => seek(one.time) }))}
              />
            )}
          </div>
        )
      )}
      {on_show === "" && <Expected />}
      {/* Below the rest in a narrow window. */}
      <div className="strip-end">
        <Verdicts />
        <TimelineSwitch />
      </div>
    </div>
  );
}

const told = ({ who, after, before }: { who: string; after: string; before: string }) => `${who}: ${after} instead of ${before}`;

/** In a low window the timeline is there when somebody asks for it. */
export function useTimeline(): boolean {
  const ready = useDesign((state) => state.summary?.shadow.ready ?? false);
  const wanted = useDesign(({ timeline }) => timeline);
  const { height } = useWindow();
  return ready && (wanted ?? height >= kWithTimeline_px);
}
const kWithTimeline_px = 740;

function TimelineSwitch() {
  const shown = useTimeline();
  return (
    <button className="button small" aria-pressed={shown} title="The shadow run over time" data-testid="timeline-switch" onClick={() => useDesign.setState({ timeline: !shown })}>
      Timeline
    </button>
  );
}

/** The moment, and in the tree the leaf that was at work; what happened is said. */
async function show_violation(violation: Violation): Promise<void> {
  go_to_violation(violation);
  useMode.setState({ happened: violation.monitor });
  const { index, selection } = useStudio.getState();
  const leaf = index?.model.tree.nodes.find(({ id }) => id === selection.node);
  // Who looks at another file stays there.
  if (leaf && tree_of(useDesign.getState())) await show_node(leaf.type, leaf.name);
}

/** What happened, of the violation that one has asked for. */
export function Happened() {
  const happened = useMode((state) => state.happened);
  const known = useStudio(({ violations }) => violations.find(({ monitor }) => monitor === happened));
  if (!known) return null;
  // Its first line says what is said here.
  const story = known.story.split("\n").slice(1).join("\n").trimEnd();
  return (
    <div className="conflict" role="status" data-testid="happened">
      <p>
        <Icon name="warning" />
        <span>
          <strong>{known.monitor}</strong> is violated at {clock_text(known.time)}.{story !== "" && <span className="happened-story">{story}</span>}
        </span>
        <button className="button small" onClick={() => useMode.setState({ mode: "run" })}>
          All panels at that moment
        </button>
        <button className="icon-button small" aria-label="Put away what happened" title="Put away" onClick={() => useMode.setState({ happened: null })}>
          <Icon name="close" />
        </button>
      </p>
    </div>
  );
}

/** Whether the shadow run came out as its scenario expects. */
function Expected() {
  const shadow = useDesign((state) => state.summary?.shadow);
  const file = useDesign((state) => `scenarios/${state.summary?.scenario ?? ""}.yaml`);
  if (!shadow?.ready || !shadow.current) return null;
  const { expects, unmet } = shadow;
  if (unmet.length > 0)
    return (
      <span className="expected" data-testid="expected">
        <MenuButton
          label={`Not as the scenario expects: ${unmet.join("; ")}`}
          data_view="expected"
          text={`✗ ${unmet.length} unexpected`}
          entries={unmet.map((one) => ({ label: one, run: () => void open_file(file) }))}
        />
      </span>
    );
  return expects ? (
    <span className="badge satisfied expected" data-testid="expected" title="Mission and monitors came out as the scenario expects">
      ✓ as expected
    </span>
  ) : null;
}

function Verdicts() {
  const monitors = useStudio((studio) => studio.state?.monitors);
  const time = useStudio((studio) => studio.state?.time ?? 0);
  /** Of the run, while another moment is shown. */
  const end = useStudio(({ state }) => (state && !state.live ? state.end : null));
  const violations = useStudio((studio) => studio.violations);
  const ready = useDesign((state) => state.summary?.shadow.ready ?? false);
  if (!ready || !monitors) return null;
  return (
    <ul className="verdict-chips" aria-label={`Verdicts at ${clock_text(time)}`}>
      <li className="mono muted" data-testid="design-clock">
        {clock_text(time)}
        {end !== null && (
          <button className="icon-button small" aria-label={`To the end of the run, ${clock_text(end)}`} title={`The run ends at ${clock_text(end)}: go there`} data-testid="to-end" onClick={go_live}>
            <Icon name="next" />
          </button>
        )}
      </li>
      <li className="how">
        <MissionStatus />
      </li>
      {Object.entries(monitors).map(([name, { verdict }]) => {
        const violation = violations.find(({ monitor }) => monitor === name);
        const text = `${kSigns[verdict]} ${name}`;
        return (
          <li key={name} className="verdict" data-verdict={verdict} data-monitor-chip={name}>
            {violation ? (
              <button className={`badge ${verdict}`} title={`${name} is violated at ${clock_text(violation.time)}: go there`} onClick={() => void show_violation(violation)}>
                {text}
                {verdict !== "violated" && " ›"}
              </button>
            ) : (
              <span className={`badge ${verdict}`} title={`${name}: ${verdict}`}>
                {text}
              </span>
            )}
          </li>
        );
      })}
    </ul>
  );
}

/** Everything that is wrong, with its ways out. */
export function Problems() {
  const findings = useProblems();
  const is_held = useDesign(held);
  if (findings.length === 0) return <p className="problems-none muted">Nothing to complain about.</p>;
  return (
    <ul className="problems scroll" aria-label="Problems">
      {findings.map((finding, i) => (
        <li key={i} className={finding.severity}>
          <button className="problem" onClick={() => finding.file !== "" && void open_file(finding.file, finding.from).then(() => choose_part_at(finding.from))}>
            <span className="sign" aria-label={finding.severity}>{finding.severity === "error" ? "✗" : "!"}</span>
            <span className="mono muted">
              {finding.file}
              {finding.line > 0 && `:${finding.line}`}
            </span>
            <span className="problem-text">{finding.message}</span>
          </button>
          {finding.fixes.map((which) => (
            <button key={which.title} className="button small" disabled={is_held !== null} title={is_held ?? undefined} onClick={() => void fix(finding, which)}>
              Write “{which.title}”
            </button>
          ))}
        </li>
      ))}
    </ul>
  );
}
