import { useState } from "react";

import type { Data } from "../protocol/types";
import { gesture } from "./design";
import { ChoiceField, set_value, ValueField, type YamlPath } from "./settings";
import { entry, typed_text, type YamlValue } from "./yaml_places";

/** A member of an entry: free text, with completion, or one of a few words. */
export interface Member {
  name: string;
  hint?: string;
  options?: readonly string[];
  is_choice?: boolean;
  is_text?: boolean;
}

/** The chart that a leaf of that name would run, else one that there is. */
export function first_skill(name: string, charts: readonly string[]): Data {
  const file = charts.find((chart) => chart === `skills/${name}.scxml`) ?? charts[0];
  return file === undefined ? {} : { file };
}

interface RowsProps {
  /** What one entry is called: "skill". */
  one: string;
  /** Of the mapping or the list. */
  path: YamlPath;
  value: YamlValue | null;
  text: string;
  members: readonly Member[];
  /** Of a mapping: names that entries can have. */
  names?: readonly string[];
  /** A new entry begins so; what may depend on its name. */
  first: Data | ((name: string) => Data);
}

/** The entries of a mapping, or of a list, of a YAML file: each a row of fields; one more; one less. */
export function EntryRows({ one, path, value, text, members, names, first }: RowsProps) {
  const [name, set_name] = useState("");
  const rows: [string | number, YamlValue][] = names === undefined ? (value?.items.map((item, i) => [i, item]) ?? []) : (value?.entries ?? []);
  const taken = rows.some(([key]) => key === name);
  const begin = (called: string) => (typeof first === "function" ? first(called) : first);
  const add = () => {
    if (names === undefined) void gesture({ what: "yaml_insert", path, index: rows.length, value: begin("") });
    else if (name !== "" && !taken) void set_value([...path, name], begin(name)).then((done) => done && set_name(""));
  };
  const id = `${path.join("-")}-names`;
  return (
    <>
      {rows.map(([key, row]) => (
        <div key={key} className="settings-row" data-entry-row={[...path, key].join(".")}>
          {names !== undefined && <strong className="settings-name mono">{key}</strong>}
          {members.map((member) => {
            const field = { label: member.name, path: [...path, key, member.name], written: typed_text(entry(row, member.name), text) };
            return member.is_choice ? (
              <ChoiceField key={member.name} {...field} options={member.options ?? []} hint={member.hint ?? ""} />
            ) : (
              <ValueField key={member.name} {...field} options={member.options ?? []} hint={member.hint ?? ""} is_text={member.is_text ?? false} />
            );
          })}
          <button type="button" className="button small" aria-label={`Delete ${one} ${key}`} onClick={() => void gesture({ what: "yaml_remove", path: [...path, key] })}>
            Delete
          </button>
        </div>
      ))}
      <div className="settings-row add">
        {names !== undefined && (
          <>
            <input
              className="field"
              aria-label={`Name of a new ${one}`}
              placeholder={`new ${one}`}
              list={names.length > 0 ? id : undefined}
              spellCheck={false}
              value={name}
              onChange={(event) => set_name(event.target.value)}
              onKeyDown={(event) => {
                if (event.key !== "Enter") return;
                event.preventDefault();
                add();
              }}
            />
            {names.length > 0 && (
              <datalist id={id}>
                {names.map((known) => (
                  <option key={known} value={known} />
                ))}
              </datalist>
            )}
          </>
        )}
        <button type="button" className="button small" disabled={names !== undefined && (name === "" || taken)} title={taken ? `There is a ${one} of that name` : undefined} onClick={add}>
          {`Add ${/^[aeiou]/.test(one) ? "an" : "a"} ${one}`}
        </button>
      </div>
    </>
  );
}
