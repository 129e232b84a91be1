import { describe, expect, it } from "vitest";

import type { NotReached } from "../../protocol/types";
import { is_never, lines_of, marks, state_key, transition_key } from "./reached";

const kFile = "skills/Ask.scxml";
const kLacking: NotReached[] = [
  ...["SUCCESS", "FAILURE", "RUNNING"].map((what): NotReached => ({ kind: "nodes", of: "Root/Go", what, file: "mission.xml", line: 4 })),
  ...["SUCCESS", "FAILURE"].map((what): NotReached => ({ kind: "nodes", of: "Root/Wait", what, file: "mission.xml", line: 5 })),
  { kind: "states", of: kFile, what: "asking", file: kFile, line: 7 },
  { kind: "transitions", of: kFile, what: "asking on a → b", file: kFile, line: 9 },
  { kind: "guards", of: kFile, what: "asking on a if x: y → b: true", file: kFile, line: 9 },
  { kind: "guards", of: kFile, what: "asking on a if x: y → b: false", file: kFile, line: 9 },
];

describe("what was not reached", () => {
  it("marks leaves that were never ticked, not those that went on to the end", () => {
    const { nodes, parts } = marks(kLacking);
    expect(is_never(nodes.get("Root/Go"), "action")).toBe(true);
    expect(is_never(nodes.get("Root/Wait"), "action")).toBe(false);
    expect(is_never(nodes.get("Root/Wait"), "condition")).toBe(true);
    expect(is_never(nodes.get("Root/Wait"), "control")).toBe(false);
    expect(parts).toEqual(new Set([state_key(`/somewhere/${kFile}`, "asking"), transition_key(`/somewhere/${kFile}`, 9)]));
  });

  it("is one line for what lacks several things", () => {
    expect(lines_of(kLacking, "nodes").map(({ lacks }) => lacks.length)).toEqual([3, 2]);
    expect(lines_of(kLacking, "guards").map(({ what, lacks }) => [what, lacks])).toEqual([["asking on a if x: y → b", ["true", "false"]]]);
  });
});
