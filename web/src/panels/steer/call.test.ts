import { describe, expect, it } from "vitest";
import { code_of } from "./call";

describe("the return code of an answer", () => {
  it("is the answer, or a member of it; the reason goes before the code", () => {
    expect(code_of("OK")).toBe("OK");
    expect(code_of({ code: "OK", goal_id: 3, error_code: "NONE" })).toBe("OK");
    expect(code_of({ code: "ERROR", error_code: "NO_VALID_PATH" })).toBe("NO_VALID_PATH");
  });
  it("is none where a service answers otherwise", () => {
    expect(code_of("the kitchen")).toBeNull();
    expect(code_of(0.5)).toBeNull();
    expect(code_of({ percentage: 0.1 })).toBeNull();
    expect(code_of(undefined)).toBeNull();
  });
});
