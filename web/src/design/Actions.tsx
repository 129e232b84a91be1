import { useState } from "react";

import type { Gesture } from "../protocol/types";
import { Icon } from "../widgets/Icon";
import { kActions } from "./chart_words";
import { focus_field, gesture } from "./design";
import { TextField } from "./TextField";

type Place = Pick<Extract<Gesture, { what: "remove_action" }>, "transition" | "state" | "block">;

/** Executable content in its order, each an element as written; or <data>. */
export function Actions({ id, title, place, actions, offered = kActions }: { id: string; title: string; place: Place; actions: readonly string[]; offered?: Readonly<Record<string, string>> }) {
  const [kind, set_kind] = useState(Object.keys(offered)[0]!);
  const add = () => {
    const xml = offered[kind]!;
    void gesture({ what: "insert_action", ...place, index: actions.length, xml }).then((done) => done && focus_field(`${id}-${actions.length}`, xml));
  };
  return (
    <fieldset className="executable" data-actions={id}>
      <legend>{title}</legend>
      {actions.map((xml, index) => (
        <div key={index} className="action">
          <TextField id={`${id}-${index}`} label={`${index + 1}`} described={`${title}, ${index + 1}`} value={xml} area tell={(text) => void gesture({ what: "set_action", ...place, index, xml: text })} />
          <div className="action-tools">
            {actions.length > 1 && (
              <button type="button" className="icon-button small" aria-label={`Earlier: ${title}, ${index + 1}`} title="Earlier" disabled={index === 0} onClick={() => void gesture({ what: "move_action", ...place, index, to: index - 1 })}>
                <span aria-hidden="true">↑</span>
              </button>
            )}
            <button type="button" className="icon-button small" aria-label={`Delete: ${title}, ${index + 1}`} title="Delete" onClick={() => void gesture({ what: "remove_action", ...place, index })}>
              <Icon name="close" />
            </button>
          </div>
        </div>
      ))}
      <div className="action-add">
        <select className="field" aria-label={`What to add: ${title}`} value={kind} onChange={(event) => set_kind(event.target.value)}>
          {Object.keys(offered).map((name) => (
            <option key={name}>{name}</option>
          ))}
        </select>
        <button type="button" className="button small" aria-label={`Add: ${title}`} onClick={add}>
          Add
        </button>
      </div>
    </fieldset>
  );
}
