import { expect, it } from "vitest";

import { corner_for } from "./Minimap";

it("the map goes to the corner in which it hides least, and stays where another one is hardly better", () => {
  const view = { scale: 2, x: 0, y: 0 };
  const [room, map] = [{ width: 400, height: 300 }, { width: 80, height: 60 }];
  const rect = (x: number, y: number, width = 40, height = 30) => ({ x: x / 2, y: y / 2, width: width / 2, height: height / 2 });
  expect(corner_for("bottom right", view, room, map, [])).toBe("bottom right");
  expect(corner_for("bottom right", view, room, map, [rect(350, 260)])).toBe("top right");
  expect(corner_for("bottom right", view, room, map, [rect(350, 260), rect(350, 20)])).toBe("top left");
  expect(corner_for("top left", view, room, map, [rect(350, 260), rect(350, 20)])).toBe("top left");
  // All corners hide something, this one not twice as much as any other.
  expect(corner_for("bottom right", view, room, map, [rect(312, 232, 80, 60), ...[[8, 8], [8, 232], [312, 8]].map(([x, y]) => rect(x!, y!, 80, 40))])).toBe("bottom right");
});
