// A run that was started without a page, and a page that comes later.
import assert from "node:assert/strict";
import { writeFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";

import { open_page, operate, shown_time, text, until, verdicts } from "../harness/browser.mjs";
import { example, run, scratch, start } from "../harness/program.mjs";

test("a page that is attached shows what was before, goes on live, and leaves the run as it was", async () => {
  const folder = scratch();
  const options = { cwd: folder, env: { ...process.env, XDG_RUNTIME_DIR: folder } };
  // In the end the robot waits at its station for somebody to come, so the run does not end before the page has been looked at.
  writeFileSync(
    join(folder, "waits.yaml"),
    `project: ${example("recharge")}
clock: {real: 10}
override: {world: {battery: {initial: 100 %}}, deadlines: {call: 1 s, condition: 2 s, budget: 3 s}}
timeline:
  - {at: 20 s, call: simulation.setBatteryCharge, args: {percent: 10}}
duration: 100 h
`,
  );
  const program = start(["run", "waits.yaml", "--record", "run.mcap"], options);
  await program.written(/battery violated at/);

  const attached = await run(["studio", "--attach", String(program.pid)], options);
  assert.equal(attached.code, 0, attached.stderr);
  const [, url] = /the page: (\S+)/.exec(attached.stderr);
  const [, told] = await program.written(/somebody attached to this run; the page: (\S+)/);
  assert.equal(told, url);

  const { page, close } = await open_page(url);
  await until(async () => /Live/.test(await text(page, "presence")), "the page is live");
  assert.equal((await verdicts(page)).battery, "violated");
  const first = await shown_time(page);
  assert.ok(first >= 20e9);
  await until(async () => (await shown_time(page)) > first, "the run goes on");

  // Its past, which no page has seen.
  await page.locator("#panel-timeline [role=slider]").focus();
  await page.keyboard.press("Home");
  await until(async () => (await shown_time(page)) === 0, "Home shows the beginning");
  assert.equal((await verdicts(page)).battery, "undecided");
  const { messages } = await operate(page, "messages", { limit: 10, filter: { name: "scenario.injection" } });
  assert.equal(messages.length, 1);
  assert.ok(messages[0].time >= 20e9 && messages[0].time < first, "it was before the page came");
  await page.keyboard.press("l");
  await until(async () => (await shown_time(page)) > first, "L shows what is now");

  // It can be steered like one that had a page from the beginning.
  await page.getByTestId("battery-robot").fill("80");
  await until(
    async () => (await operate(page, "messages", { limit: 10, filter: { name: "scenario.injection" } })).messages.length > 1,
    "the battery is charged from the page",
  );
  await close();
  assert.equal(await program.stop(), 130);
  assert.doesNotMatch(program.output(), /page stays/);
});

test("to attach again gives the same page, and says so again", async () => {
  const folder = scratch();
  const options = { cwd: folder, env: { ...process.env, XDG_RUNTIME_DIR: folder } };
  const program = start(["run", example("recharge"), "--clock", "real", "--scenario", "experiment1"], options);
  await program.written(/GoTo\w+: RUNNING/);
  const pages = [];
  for (let i = 0; i < 2; i++) {
    const { code, stderr } = await run(["studio", "--attach"], options);
    assert.equal(code, 0, stderr);
    pages.push(/the page: (\S+)/.exec(stderr)[1]);
  }
  assert.equal(pages[0], pages[1]);
  await program.written(/(somebody attached[^\n]*\n[^]*){2}/);
  const health = await (await fetch(new URL("api/health", pages[0]))).json();
  assert.equal(health.mode, "live");
  await program.stop();
});
