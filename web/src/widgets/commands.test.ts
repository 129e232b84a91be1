import { expect, it } from "vitest";

import { key_text } from "./commands";
import { matches } from "./match";
import { next_speed } from "./run_commands";

const key = (name: string, modifiers: Partial<Record<"ctrlKey" | "shiftKey" | "altKey" | "metaKey", boolean>> = {}) =>
  key_text({ key: name, ctrlKey: false, shiftKey: false, altKey: false, metaKey: false, ...modifiers });

it("keys have one name on every keyboard", () => {
  expect(key(" ")).toBe("Space");
  expect(key("l")).toBe("L");
  expect(key("N", { shiftKey: true })).toBe("Shift+N");
  expect(key("k", { ctrlKey: true })).toBe("Ctrl+K");
  expect(key("k", { metaKey: true })).toBe("Ctrl+K");
  // A question mark needs Shift on some keyboards only.
  expect(key("?", { shiftKey: true })).toBe("?");
  expect(key("ArrowLeft", { shiftKey: true })).toBe("Shift+ArrowLeft");
});

it("words match in any order and case", () => {
  expect(matches("kit goto", "GoToKitchen")).toBe(true);
  expect(matches("station", "GoToKitchen")).toBe(false);
  expect(matches("", "anything")).toBe(true);
});

it("speeds have ends", () => {
  expect(next_speed(1, 1)).toBe(2);
  expect(next_speed(1, -1)).toBe(0.5);
  expect(next_speed(16, 1)).toBe(16);
  expect(next_speed(3, -1)).toBe(2);
});
