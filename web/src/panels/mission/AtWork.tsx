import type { ReactNode } from "react";

import { duration_text } from "../../draw/format";
import { kStatuses } from "../../protocol/types";
import { useStudio, type Index } from "../../store/store";
import { jump_to } from "./mission";
import { StatusSign } from "./StatusSign";
import { running } from "./tree";

/** More are only counted. */
const kChipsMax = 5;

/** What the mission is at, with how long already; a click goes there. */
export function AtWork({ index, children }: { index: Index; children?: ReactNode }) {
  // As text, so that only a change of the list draws it anew.
  const ids = useStudio((studio) => (studio.state ? running(index.children, studio.state.tree.status).join() : ""));
  const list = ids === "" ? [] : ids.split(",").map(Number);
  return (
    <div className="at-work" role="group" aria-label="Nodes at work">
      <span className="at-work-title">At work</span>
      {list.length === 0 && <span className="muted">nothing</span>}
      {list.slice(0, kChipsMax).map((id) => (
        <Chip key={id} id={id} name={index.model.tree.nodes[id]?.name ?? String(id)} />
      ))}
      {list.length > kChipsMax && <span className="at-work-title">and {list.length - kChipsMax} more</span>}
      {children}
    </div>
  );
}

function Chip({ id, name }: { id: number; name: string }) {
  const status = useStudio((studio) => studio.state?.tree.status[id] ?? 0);
  const age = useStudio((studio) => {
    const state = studio.state;
    return state ? duration_text(Math.floor((state.time - (state.tree.since[id] ?? state.time)) / 1e8) * 1e8) : "";
  });
  const chosen = useStudio((studio) => studio.selection.node === id);
  const word = (kStatuses[status] ?? "IDLE").toLowerCase();
  return (
    <button className={`chip ${word}`} aria-pressed={chosen} onClick={() => jump_to(id)} title={`${name}: ${word} for ${age}. Show it in the tree`}>
      <svg className="chip-sign" viewBox="-9 -9 18 18" aria-hidden="true">
        <StatusSign status={status} />
      </svg>
      <span className="ellipsis">{name}</span>
      <span className="chip-age number">{age}</span>
    </button>
  );
}
