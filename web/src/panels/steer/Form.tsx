import { useId } from "react";

import type { IdlField, IdlTypes } from "../../protocol/types";
import { Icon } from "../../widgets/Icon";
import { new_draft, type Draft, type DraftField, type FormError } from "./idl";

/** The fields of a method or a struct, each with an editor of its type. */
export function Fields({ fields, drafts, types, errors, path = "", change }: { fields: readonly IdlField[]; drafts: Record<string, DraftField>; types: IdlTypes; errors: readonly FormError[]; path?: string; change(drafts: Record<string, DraftField>): void }) {
  return (
    <>
      {fields.map((field) => {
        const entry = drafts[field.name] ?? { given: false, draft: { kind: "text", text: "" } };
        const where = path ? `${path}.${field.name}` : field.name;
        const set = (next: DraftField) => change({ ...drafts, [field.name]: next });
        return (
          <FieldRow key={field.name} field={field} entry={entry} types={types} errors={errors} path={where} set={set} />
        );
      })}
    </>
  );
}

function FieldRow({ field, entry, types, errors, path, set }: { field: IdlField; entry: DraftField; types: IdlTypes; errors: readonly FormError[]; path: string; set(next: DraftField): void }) {
  const id = useId();
  const described = types[field.type];
  const nested = entry.given && described !== undefined && described.kind !== "enum";
  const give = (given: boolean) => set({ given, draft: given ? new_draft(field.type, types, field.default) : entry.draft });
  return (
    <div className={nested ? "form-group" : "form-row"}>
      <label className="form-label" htmlFor={nested ? undefined : id} title={`${field.name}: ${field.type}`}>
        {!field.required && (
          <input type="checkbox" checked={entry.given} onChange={(event) => give(event.target.checked)} aria-label={`Give ${field.name}`} title={field.default === undefined ? "Optional" : `Not given: ${String(field.default)}`} />
        )}
        <span className="ellipsis">{field.name}</span>
        <span className="form-type">{field.unit || (described ? "" : field.type)}</span>
      </label>
      {entry.given ? (
        <Editor id={id} label={path} type={field.type} draft={entry.draft} types={types} errors={errors} path={path} change={(draft) => set({ given: true, draft })} />
      ) : (
        <span className="muted form-absent">{field.default === undefined ? "not given" : `as the IDL says: ${String(field.default)}`}</span>
      )}
    </div>
  );
}

/** The editor of one value. */
export function Editor({ id, label, type, draft, types, errors, path, change }: { id?: string; label: string; type: string; draft: Draft; types: IdlTypes; errors: readonly FormError[]; path: string; change(draft: Draft): void }) {
  const described = types[type];
  const error = errors.find((entry) => entry.path === path);
  switch (draft.kind) {
    case "bool":
      return (
        <span className="form-check">
          <input id={id} type="checkbox" aria-label={label} checked={draft.on} onChange={(event) => change({ kind: "bool", on: event.target.checked })} />
          {draft.on ? "true" : "false"}
        </span>
      );
    case "choice":
      return (
        <select id={id} className="field small" aria-label={label} value={draft.name} onChange={(event) => change({ kind: "choice", name: event.target.value })}>
          {described?.kind === "enum" && described.values.map((name) => <option key={name}>{name}</option>)}
        </select>
      );
    case "text":
      return (
        <span className="form-value">
          <input
            id={id}
            className={`field small${type === "string" ? "" : " number"}`}
            aria-label={label}
            aria-invalid={error !== undefined}
            value={draft.text}
            inputMode={type === "string" || type === "binary" ? "text" : "decimal"}
            spellCheck={false}
            onChange={(event) => change({ kind: "text", text: event.target.value })}
          />
          {error && <span className="form-error">{error.message}</span>}
        </span>
      );
    case "struct":
      return (
        <div className="form-struct">
          {described && "fields" in described && (
            <Fields fields={described.fields} drafts={draft.fields} types={types} errors={errors} path={path} change={(fields) => change({ kind: "struct", fields })} />
          )}
          {error && <span className="form-error">{error.message}</span>}
        </div>
      );
    case "list": {
      const element = described?.kind === "list" || described?.kind === "set" ? described.element : "string";
      return (
        <div className="form-struct">
          {draft.items.map((item, i) => (
            <div className="form-item" key={i}>
              <Editor label={`${label} ${i + 1}`} type={element} draft={item} types={types} errors={errors} path={`${path}[${i}]`} change={(next) => change({ kind: "list", items: draft.items.map((other, j) => (j === i ? next : other)) })} />
              <Remove label={`Remove ${label} ${i + 1}`} run={() => change({ kind: "list", items: draft.items.filter((_, j) => j !== i) })} />
            </div>
          ))}
          <Add label={label} run={() => change({ kind: "list", items: [...draft.items, new_draft(element, types)] })} />
        </div>
      );
    }
    case "map": {
      if (described?.kind !== "map") return null;
      const set = (i: number, entry: [Draft, Draft]) => change({ kind: "map", entries: draft.entries.map((other, j) => (j === i ? entry : other)) });
      return (
        <div className="form-struct">
          {draft.entries.map(([key, value], i) => (
            <div className="form-item" key={i}>
              <Editor label={`key ${i + 1} of ${label}`} type={described.key} draft={key} types={types} errors={errors} path={`${path}[${i}].key`} change={(next) => set(i, [next, value])} />
              <Editor label={`value ${i + 1} of ${label}`} type={described.element} draft={value} types={types} errors={errors} path={`${path}[${i}]`} change={(next) => set(i, [key, next])} />
              <Remove label={`Remove entry ${i + 1} of ${label}`} run={() => change({ kind: "map", entries: draft.entries.filter((_, j) => j !== i) })} />
            </div>
          ))}
          <Add label={label} run={() => change({ kind: "map", entries: [...draft.entries, [new_draft(described.key, types), new_draft(described.element, types)]] })} />
        </div>
      );
    }
  }
}

function Remove({ label, run }: { label: string; run(): void }) {
  return (
    <button type="button" className="icon-button" aria-label={label} title="Remove" onClick={run}>
      <Icon name="close" />
    </button>
  );
}

function Add({ label, run }: { label: string; run(): void }) {
  return (
    <button type="button" className="button small" aria-label={`Add to ${label}`} onClick={run}>
      <Icon name="plus" />
      Add
    </button>
  );
}
