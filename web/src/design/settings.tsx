import { useId } from "react";

import type { Data } from "../protocol/types";
import { gesture } from "./design";
import { useTyped } from "./use_typed";
import { data_in } from "./yaml_places";

export type YamlPath = (string | number)[];

/** Writes one value of the open file; null takes it away. */
export function set_value(path: YamlPath, value: Data | null, meant_of?: number): Promise<boolean> {
  return gesture(value === null ? { what: "yaml_remove", path } : { what: "yaml_set", path, value }, meant_of);
}

interface FieldProps {
  label: string;
  path: YamlPath;
  /** As it is written; empty: it is not. */
  written: string;
  hint?: string;
  options?: readonly string[];
  /** What is typed is a text, whatever it looks like. */
  is_text?: boolean;
  wrong?: boolean;
}

/** A value; an empty field takes it away. */
export function ValueField({ label, path, written, hint, options = [], is_text = false, wrong = false }: FieldProps) {
  const id = useId();
  const typed = useTyped(written, (text) => set_value(path, text === "" ? null : is_text ? text : data_in(text)));
  return (
    <div className="inspector-field" data-setting={path.join(".")}>
      <label htmlFor={id}>{label}</label>
      <input
        id={id}
        className="field"
        list={options.length > 0 ? `${id}-options` : undefined}
        placeholder={hint}
        aria-invalid={wrong || undefined}
        {...typed}
      />
      {options.length > 0 && (
        <datalist id={`${id}-options`}>
          {options.map((option) => (
            <option key={option} value={option} />
          ))}
        </datalist>
      )}
    </div>
  );
}

/** One of a few words; the first, empty, takes it away. */
export function ChoiceField({ label, path, written, options, hint = "" }: { label: string; path: YamlPath; written: string; options: readonly string[]; hint?: string }) {
  const id = useId();
  const known = written === "" || options.includes(written) ? options : [...options, written];
  return (
    <div className="inspector-field" data-setting={path.join(".")}>
      <label htmlFor={id}>{label}</label>
      <select id={id} className="field" value={written} onChange={(event) => void set_value(path, event.target.value === "" ? null : data_in(event.target.value))}>
        <option value="">{hint || "–"}</option>
        {known.map((option) => (
          <option key={option}>{option}</option>
        ))}
      </select>
    </div>
  );
}
