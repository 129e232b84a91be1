import { useMemo, useState } from "react";

import type { ServiceModel } from "../../protocol/types";
import { useStudio } from "../../store/store";
import { Fields } from "./Form";
import { arguments_draft, read_arguments, type DraftField } from "./idl";
import { intervene } from "./steering";

const kNone: readonly ServiceModel[] = [];

/** Any method of any service, with a form made from its interface. */
export function CallTab() {
  const services = useStudio((studio) => studio.index?.model.services) ?? kNone;
  const [at, set_at] = useState({ service: "", method: "" });
  const [edited, set_edited] = useState<{ of: string; drafts: Record<string, DraftField> } | null>(null);
  const [outcome, set_outcome] = useState<{ of: string; text: string } | null>(null);
  const [busy, set_busy] = useState(false);

  const service = services.find(({ name }) => name === at.service) ?? services[0];
  const method = service?.methods.find(({ name }) => name === at.method) ?? service?.methods[0];
  const name = service && method ? `${service.name}.${method.name}` : "";
  const fresh = useMemo(() => (service && method ? arguments_draft(method, service.types) : {}), [service, method]);
  if (!service || !method) return <p className="muted">This run has no services.</p>;
  const drafts = edited?.of === name ? edited.drafts : fresh;
  const read = read_arguments(method, drafts, service.types);
  const run = async () => {
    set_busy(true);
    const answer = await intervene({ call: name, args: read.value });
    set_busy(false);
    set_outcome(answer ? { of: name, text: answer.result === undefined || answer.result === null ? "done" : JSON.stringify(answer.result, null, 2) } : null);
  };
  return (
    <form
      className="form"
      onSubmit={(event) => {
        event.preventDefault();
        if (read.errors.length === 0 && !busy) void run();
      }}
    >
      <div className="row">
        <select className="field small grow" aria-label="Service" value={service.name} onChange={(event) => set_at({ service: event.target.value, method: "" })} data-testid="call-service">
          {services.map((entry) => (
            <option key={entry.name} value={entry.name}>
              {entry.name}
            </option>
          ))}
        </select>
        <select className="field small grow" aria-label="Method" value={method.name} onChange={(event) => set_at({ service: service.name, method: event.target.value })} data-testid="call-method">
          {service.methods.map((entry) => (
            <option key={entry.name}>{entry.name}</option>
          ))}
        </select>
        <button type="submit" className="button small primary" disabled={read.errors.length > 0 || busy}>
          Call
        </button>
      </div>
      <Fields fields={method.args} drafts={drafts} types={service.types} errors={read.errors} change={(next) => set_edited({ of: name, drafts: next })} />
      {method.args.length === 0 && <p className="muted">No arguments.</p>}
      {outcome?.of === name && (
        <pre className="outcome mono" aria-label="Result" role="status">
          {outcome.text}
        </pre>
      )}
    </form>
  );
}
