import { useEffect, useRef, useState, type ReactNode } from "react";

import { obstacle, useDesign } from "./design";

/** Of a field of several lines: what it shows at most, and about how much stands in one. */
const kRowsMax = 8;
const kColumns = 28;

interface TextFieldProps {
  id: string;
  label: ReactNode;
  /** For who does not see where the field stands. */
  described?: string;
  value: string;
  hint?: string;
  /** Offered while one types. */
  options?: readonly string[];
  /** Several lines; Shift+Enter begins one. */
  area?: boolean;
  tell(text: string): void;
  /** Escape was pressed. */
  escape?(): void;
  /** The field has been left. */
  left?(): void;
}

/** A value that is told when one leaves the field or presses Enter; Escape brings back what it was. */
export function TextField({ id, label, described, value, hint, options = [], area = false, tell, escape, left }: TextFieldProps) {
  const why_not = useDesign(obstacle);
  const [text, set_text] = useState(value);
  // Enter tells, and so does leaving the field; once is enough.
  const told = useRef(value);
  useEffect(() => {
    set_text(value);
    told.current = value;
  }, [value]);
  // What is told may make another element of it, of one line or of several.
  const by_enter = useRef(false);
  useEffect(() => {
    // Who went elsewhere meanwhile stays there.
    if (by_enter.current && document.activeElement === document.body) document.getElementById(id)?.focus();
    by_enter.current = false;
  }, [id, area]);
  const done = () => {
    if (text === value || text === told.current) return;
    told.current = text;
    tell(text);
  };
  const common = {
    id,
    className: "field",
    "aria-label": described,
    placeholder: hint,
    spellCheck: false,
    autoComplete: "off",
    value: text,
    title: why_not ?? text,
    "data-unsent": text !== value,
    onChange: (event: React.ChangeEvent<HTMLInputElement | HTMLTextAreaElement>) => {
      by_enter.current = false;
      told.current = value;
      set_text(event.target.value);
    },
    onBlur: () => {
      done();
      left?.();
    },
    onKeyDown: (event: React.KeyboardEvent) => {
      if (event.key === "Enter" && !event.shiftKey) {
        event.preventDefault();
        by_enter.current = text !== value;
        done();
      } else if (event.key === "Escape") {
        set_text(value);
        told.current = text;
        escape?.();
      }
    },
  };
  return (
    <div className="inspector-field">
      <label htmlFor={id}>{label}</label>
      {area ? <textarea {...common} className="field mono" rows={Math.min(kRowsMax, text.split("\n").reduce((rows, line) => rows + Math.max(1, Math.ceil(line.length / kColumns)), 0))} /> : <input {...common} list={options.length > 0 ? `${id}-options` : undefined} />}
      <Options id={id} options={options} />
    </div>
  );
}

/** What the field `id` offers. */
export function Options({ id, options }: { id: string; options: readonly string[] }) {
  if (options.length === 0) return null;
  return (
    <datalist id={`${id}-options`}>
      {options.map((option) => (
        <option key={option} value={option} />
      ))}
    </datalist>
  );
}
