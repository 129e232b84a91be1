import { describe, expect, it } from "vitest";

import { definitions_of } from "./requirement_text";

const kText = `# let nothing = 1
let level [%] = reply(battery.getBatteryState).percentage * 100   # as the station has it
let at(place)   = reply(navigation.checkNearToLocation where
    args.name = place)
never_empty: always level >= 20 %.
`;

describe("definitions of requirements", () => {
  it("stand where their expressions do", () => {
    const found = definitions_of(kText);
    expect(found.map(({ name, head, expression }) => [name, head, expression])).toEqual([
      ["level", "level [%]", "reply(battery.getBatteryState).percentage * 100"],
      ["at", "at(place)", "reply(navigation.checkNearToLocation where args.name = place)"],
    ]);
    for (const { from, to, expression, at } of found) {
      expect(kText.slice(from, to).replace(/\s+/g, " ")).toBe(expression);
      expect(kText.startsWith("let", at)).toBe(true);
    }
  });
});
