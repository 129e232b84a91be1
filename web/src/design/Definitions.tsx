import { useId, useMemo } from "react";

import { edit_text, go_to, type Doc } from "./design";
import { GrowingField } from "./GrowingField";
import { definitions_of, type Definition } from "./requirement_text";
import { useTyped } from "./use_typed";

/** What the requirements of a file call things: each `let` with what it stands for. */
export function Definitions({ doc }: { doc: Doc }) {
  const found = useMemo(() => definitions_of(doc.places.shown), [doc]);
  if (found.length === 0) return null;
  return (
    <section className="sentence" aria-label="Definitions" data-testid="definitions">
      <h3>Definitions</h3>
      {found.map((one) => (
        <Row key={one.name} doc={doc} one={one} />
      ))}
    </section>
  );
}

function Row({ doc, one: { name, head, expression, at, from, to } }: { doc: Doc; one: Definition }) {
  const id = useId();
  const typed = useTyped(expression, async (text) => {
    if (text === "") return false;
    await edit_text(doc.file, doc.places.shown, [{ from, to, text }], `define ${name}`);
    return true;
  });
  return (
    <div className="settings-row" data-definition={name}>
      <button type="button" className="past-name mono" title="Go to it in the text" onClick={() => go_to(doc.places.byte(at), true)}>
        {head}
      </button>
      <label htmlFor={id} className="hidden-text">
        {name} stands for
      </label>
      <GrowingField id={id} typed={typed} />
    </div>
  );
}
