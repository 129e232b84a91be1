import type { Reached } from "../../protocol/types";

/** What every behaviour means: how far they were tried, and of which texts. */
export function VerifiedNote({ of }: { of: Reached["verification"] }) {
  if (!of) return null;
  const { complete, tick, states, changed } = of;
  return (
    <p className="muted reached-note" data-testid="verified">
      {states.toLocaleString("en")} states of the mission, {complete ? "every behaviour" : `every behaviour up to tick ${tick}`}
      {changed.length > 0 && (
        <span className="reached-old" role="status">
          {" "}
          – before {changed.slice(0, 3).join(", ")}
          {changed.length > 3 ? ` and ${changed.length - 3} more` : ""} changed: sentree verify tries it again
        </span>
      )}
    </p>
  );
}

export const kNotVerified = "No verification is there: sentree verify tries every behaviour, and leaves what none of them reaches beside its counterexamples.";
