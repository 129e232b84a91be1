import { dismiss, useStudio } from "../store/store";
import { Icon } from "../widgets/Icon";

/** Refusals and short messages; they go away by themselves. `over`: where they lie over nothing, in the header. */
export function Notes({ over = false }: { over?: boolean }) {
  const notes = useStudio((studio) => studio.notes);
  return (
    <div className={over ? "notes over" : "notes"} aria-live="polite">
      {notes.map(({ id, kind, text }) => (
        <div key={id} className={`note ${kind}`}>
          <Icon name={kind === "error" ? "warning" : "info"} />
          <span title={over ? text : undefined}>{text}</span>
          <button className="icon-button" onClick={() => dismiss(id)} aria-label="Dismiss">
            <Icon name="close" />
          </button>
        </div>
      ))}
    </div>
  );
}
