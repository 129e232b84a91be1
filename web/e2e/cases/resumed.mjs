// A run that was killed and resumed is one timeline, with the gap in which nobody was there.
import assert from "node:assert/strict";
import { cpSync, existsSync, mkdirSync, readdirSync, renameSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";

import { open_page, operate } from "../harness/browser.mjs";
import { example, run, scratch, serve, start } from "../harness/program.mjs";

const lanes_of = (page) => operate(page, "lanes", { from: 0, to: 3_600_000_000_000, width: 1000 });

test("the recordings of a resumed run are shown as one, from its beginning", async () => {
  const folder = scratch();
  cpSync(example("recharge"), join(folder, "recharge"), { recursive: true });
  const scenario = join(folder, "mission.yaml");
  writeFileSync(scenario, `project: ${folder}/recharge\nclock: {real: 5}\nduration: 1 min\noverride:\n  deadlines: {call: 2 s, condition: 4 s, budget: 5 s, unresponsive: 10 s}\n`);
  const runs = join(folder, "recordings");
  const first = join(runs, "first.mcap");
  mkdirSync(runs);
  const killed = start(["run", scenario, "--durable=each", "--verbose", "--record", first]);
  await killed.written(/\n +9\.\d+ s {2}/);
  await killed.stop("SIGKILL");
  const resumed = await run(["run", "--resume", first, "--record", join(runs, "second.mcap")]);
  const second = readdirSync(runs).filter((name) => name.endsWith(".mcap") && name !== "first.mcap").map((name) => join(runs, name))[0];
  assert.ok(second && existsSync(second), resumed.stdout + resumed.stderr);

  const program = await serve(["studio", second]);
  const { page, close } = await open_page(program.url);
  const { lanes, marks } = await lanes_of(page);
  const gap = marks.find(({ kind }) => kind === "gap");
  assert.ok(gap && gap.from <= gap.time, JSON.stringify(marks));
  assert.match(gap.text, /nobody was there for [\d.]+ s/);
  assert.ok(gap.from > 0, "it had begun before");
  const spans = lanes.filter(({ kind }) => kind === "leaf").flatMap((lane) => lane.spans ?? []);
  assert.ok(spans.some(([from]) => from < gap.from), "what was before is on the timeline");
  assert.ok(spans.some(([, to]) => to > gap.time), "and what came after");
  // Every observation once, over both.
  const { messages } = await operate(page, "messages", { limit: 500, filter: { name: "mission.tick" }, until: gap.time + 2_000_000_000 });
  const numbers = messages.map(({ sequence }) => sequence);
  assert.deepEqual(numbers, [...new Set(numbers)].sort((a, b) => a - b));
  assert.ok(messages.some(({ time }) => time < gap.from) && messages.some(({ time }) => time >= gap.time));
  // The moment before the gap can be looked at.
  const shown = await operate(page, "seek", { time: Math.floor(gap.from / 2) });
  assert.equal(shown.time, Math.floor(gap.from / 2));
  if (process.env.SENTREE_PICTURES) await page.screenshot({ path: join(process.env.SENTREE_PICTURES, "resumed.png") });
  await close();
  await program.stop();

  // Alone, the second part is shown as before, and still says that there is a gap.
  renameSync(first, join(folder, "elsewhere.mcap"));
  const alone = await serve(["studio", second]);
  const without = await open_page(alone.url);
  const rest = await lanes_of(without.page);
  assert.ok(rest.marks.some(({ kind }) => kind === "gap"));
  // It begins with what the first had not written any more.
  const { messages: own } = await operate(without.page, "messages", { limit: 500, filter: { name: "mission.tick" }, until: gap.time + 2_000_000_000 });
  assert.ok(own.length > 0 && own[0].sequence > numbers[0], `${own[0]?.sequence} after ${numbers[0]}`);
  await without.close();
  await alone.stop();
});
