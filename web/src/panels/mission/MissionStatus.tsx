import { useStudio } from "../../store/store";
import { Icon, type IconName } from "../../widgets/Icon";
import { reason_at } from "./tree";

const kClass: Readonly<Record<string, string>> = { RUNNING: "running", SUCCESS: "success", FAILURE: "failure", HALTING: "halting" };
const kIcon: Readonly<Record<string, IconName>> = { RUNNING: "play", SUCCESS: "check", FAILURE: "cross" };

/** What the mission is at the moment shown, or how it ended. */
export function MissionStatus() {
  const status = useStudio((studio) => studio.state?.run.mission ?? "");
  const reason = useStudio(({ state }) => (state ? reason_at(state) : ""));
  // Ended from outside: by its time limit, or by a person.
  const cut = useStudio(({ state }) => state?.run.state === "ended" && state.live) && status === "RUNNING";
  if (!status) return null;
  return (
    <span className={`badge mission-badge ${cut ? "" : (kClass[status] ?? "")}`} data-testid="mission-status" title={cut ? "The run ended before the mission did" : reason || "Status of the mission"}>
      <Icon name={cut ? "minus" : (kIcon[status] ?? "minus")} />
      <span className="room-3">{cut ? `${status} at the end` : status}</span>
      {reason && <span className="reason ellipsis">{reason}</span>}
    </span>
  );
}
