import { TypeCompiler } from "@sinclair/typebox/compiler";
import { readFileSync } from "node:fs";
import { describe, expect, it } from "vitest";

import { Operations, ServerMessages } from "./protocol";

const checks = Object.fromEntries(Object.entries(ServerMessages).map(([name, schema]) => [name, TypeCompiler.Compile(schema)]));

/** What is wrong with a message of the program; null: nothing. */
function wrong(message: { type: string }): string | null {
  const check = checks[message.type];
  if (!check) return `no message is of type ${message.type}`;
  const error = check.Errors(message).First();
  return error ? `${message.type}${error.path}: ${error.message}, not ${JSON.stringify(error.value)?.slice(0, 200)}` : null;
}

describe("the description of the protocol", () => {
  it("refuses members that it does not know, and those that are missing", () => {
    expect(wrong({ type: "problem", text: "late", time: 1 } as { type: string })).toBeNull();
    expect(wrong({ type: "problem", text: "late", time: 1.5 } as { type: string })).toMatch(/problem\/time/);
    expect(wrong({ type: "problem", text: "late", time: 1, why: "" } as { type: string })).toMatch(/problem\/why/);
    expect(wrong({ type: "problem", time: 1 } as { type: string })).toMatch(/problem\/text/);
    expect(wrong({ type: "greeting" })).toMatch(/greeting/);
  });

  // web/e2e/protocol.mjs runs the program's own tests of the server, which leave what was sent in this file.
  const file = process.env["SENTREE_MESSAGES"];
  it.runIf(file)("holds for every message that the server's tests got", () => {
    const messages = readFileSync(file ?? "", "utf8").trim().split("\n").map((line) => JSON.parse(line) as { type: string });
    const seen = new Set(messages.map(({ type }) => type));
    for (const type of ["hello", "model", "state", "delta", "violation", "answer"]) expect(seen).toContain(type);
    expect([...new Set(messages.map(wrong).filter((error) => error !== null))]).toEqual([]);
    const values = messages.filter((message): message is { type: string; value: object } => message.type === "answer" && "value" in message && message.value !== null && typeof message.value === "object");
    for (const [op, member] of [["messages", "messages"], ["lanes", "lanes"], ["layout", "nodes"], ["fold_chart", "hidden"]] as const) {
      const answers = values.filter(({ value }) => member in value);
      expect(answers.length, op).toBeGreaterThan(0);
      const check = TypeCompiler.Compile(Operations[op][1]);
      for (const { value } of answers) expect(check.Errors(value).First()).toBeUndefined();
    }
  }, 60_000);
});
