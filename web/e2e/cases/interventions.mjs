// Breakpoints, faults, forced results, and runs saved as scenarios, by hand from the page.
import assert from "node:assert/strict";
import { cpSync, readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";

import { first_message, interventions, open_page, open_tab, operate, state_of, text, until, verdicts } from "../harness/browser.mjs";
import { open_design, serve_design, undo_name } from "../harness/design.mjs";
import { example, run, scratch, serve_run } from "../harness/program.mjs";

test("a breakpoint on a node stops the run there; a step goes on by one tick", async () => {
  const program = await serve_run(example("recharge"), { scenario: "normal" });
  const { page, close } = await open_page(program.url);
  await page.locator("[data-node]", { hasText: "GoToStation" }).click({ button: "right" });
  await page.getByRole("menuitemcheckbox", { name: "running" }).first().click();
  await page.getByTestId("battery-robot").fill("25");
  await until(async () => (await text(page, "presence")).includes("Stopped at"), "the run stands at the breakpoint");
  const stopped = await state_of(page);
  assert.equal(stopped.run.state, "paused");
  const node = (await first_message(page, "model")).tree.nodes.find(({ name }) => name === "GoToStation");
  assert.equal(stopped.tree.status[node.id], 1, "GoToStation is RUNNING");
  await page.getByTestId("step").click();
  await until(async () => (await state_of(page)).tick === stopped.tick + 1, "one tick on");
  assert.equal((await state_of(page)).run.state, "paused");

  await open_tab(page, "Standing");
  await page.getByRole("button", { name: /^Clear breakpoint/ }).click();
  await until(async () => (await operate(page, "interventions")).length === 0, "the breakpoint is gone");
  await close();
  await program.stop();
});

test("a leaf's forced result holds until it is cleared", async () => {
  const program = await serve_run(example("recharge"), { scenario: "normal" });
  const { page, close } = await open_page(program.url);
  const leaf = page.locator("[data-node]", { hasText: "BatteryLevelAbove30" });
  await leaf.click({ button: "right" });
  await page.getByRole("menuitemcheckbox", { name: "failure" }).last().click();
  await page.locator("[data-node] .forced").waitFor();
  const node = (await first_message(page, "model")).tree.nodes.find(({ name }) => name === "GoToStation");
  await until(async () => (await state_of(page)).tree.status[node.id] === 1, "the mission goes to the station");
  await leaf.click({ button: "right" });
  await page.getByRole("menuitem", { name: "Clear all of these" }).click();
  await until(async () => (await state_of(page)).tree.status[node.id] !== 1, "the mission goes to the kitchen again");
  await close();
  await program.stop();
});

test("a falsified reply reaches the skill, the service stays as it is", async () => {
  const program = await serve_run(example("recharge"), { scenario: "normal" });
  const { page, close } = await open_page(program.url);
  await open_tab(page, "Faults");
  await page.getByLabel("Member").selectOption("percentage");
  await page.getByLabel("Value", { exact: true }).fill("much");
  assert.ok(await page.getByRole("button", { name: "Falsify" }).isDisabled(), "what is no number cannot be sent");
  await page.getByLabel("Value", { exact: true }).fill("0.15");
  await page.getByRole("button", { name: "Falsify" }).click();
  await until(async () => (await verdicts(page)).battery === "violated", "the monitor sees the falsified reply");
  const battery = (await state_of(page)).robots.robot.battery;
  assert.ok(battery.percentage > 0.5, "the battery itself is full");
  await close();
  await program.stop();
});

test("a service is cut off, and answers too late, until that is cleared", async () => {
  const program = await serve_run(example("recharge"), { scenario: "normal" });
  const { page, close } = await open_page(program.url);
  for (const [kind, button] of [["unreachable", "Cut off"], ["late", "Let them be late"]]) {
    await open_tab(page, "Faults");
    await page.getByTestId("fault-kind").selectOption(kind);
    await page.getByTestId("stage").getByLabel("Service").selectOption("battery");
    await page.getByTestId("stage").getByLabel("Method").selectOption("getBatteryState");
    await page.getByRole("button", { name: button }).click();
    await until(async () => (await operate(page, "interventions")).some((one) => one[kind] === "battery.getBatteryState"), `it stands: ${kind}`);
    const named = async () => (await operate(page, "messages", { limit: 500, filter: { name: "battery.getBatteryState.error" } })).messages.some(({ data }) => JSON.stringify(data).includes(kind));
    await until(named, `a call ends as ${kind}`);
    await open_tab(page, "Standing");
    await page.getByRole("button", { name: new RegExp(`^Clear ${kind}`) }).click();
    await until(async () => (await operate(page, "interventions")).length === 0, "it is cleared");
  }
  await close();
  await program.stop();
});

test("a skill is killed and restarted", async () => {
  const program = await serve_run(example("recharge"), { scenario: "normal" });
  const { page, close } = await open_page(program.url);
  await open_tab(page, "Parts");
  await page.getByRole("button", { name: "Kill WaitForUser" }).click();
  await page.getByRole("row", { name: /WaitForUser/ }).getByText("killed").waitFor();
  await page.getByRole("button", { name: "Restart WaitForUser" }).click();
  await page.getByRole("row", { name: /WaitForUser/ }).getByText("thread").waitFor();
  const seen = (await interventions(page)).join("\n");
  assert.match(seen, /kill/);
  assert.match(seen, /restart/);
  await close();
  await program.stop();
});

test("a part in a process of its own goes by the name of that process", async () => {
  const project = join(scratch(), "recharge");
  cpSync(example("recharge"), project, { recursive: true });
  // A part that the mission does not need on its way, which takes eleven minutes.
  writeFileSync(
    join(project, "scenarios/apart.yaml"),
    `clock: {real: 0.1}
processes:
  robot: {component: sim, listen: "tcp://127.0.0.1:0"}
  person: {skill: WaitForUser, listen: "unix:{run}/person.sock"}
override:
  services: {battery: {at: "{robot}"}, navigation: {at: "{robot}"}}
  skills: {WaitForUser: {at: "{person}"}}
  deadlines: {call: 1 s, condition: 2 s, budget: 3 s, unresponsive: 5 s}
duration: 1 h
`,
  );
  const program = await serve_run(project, { scenario: "apart" });
  const { page, close } = await open_page(program.url);
  await open_tab(page, "Parts");
  const row = page.getByRole("row", { name: /person/ });
  await row.getByText(/process \d+/).waitFor();
  await page.getByRole("button", { name: "Kill person" }).click();
  await row.getByText("not running").waitFor();
  await page.getByRole("button", { name: "Restart person" }).click();
  await row.getByText(/process \d+/).waitFor();
  await close();
  await program.stop();
});

test("what was done is saved as a scenario that does the same again", async () => {
  const project = join(scratch(), "recharge");
  cpSync(example("recharge"), project, { recursive: true });
  const program = await serve_run(project, { scenario: "normal" });
  const { page, close } = await open_page(program.url);
  await page.getByTestId("battery-robot").fill("10");
  await page.getByTestId("violation-banner").waitFor();
  await open_tab(page, "Save");
  await page.getByTestId("scenario-name").fill("by-hand");
  await page.getByTestId("save-scenario").click();
  assert.match(await page.getByTestId("saved-file").innerText(), /by-hand\.yaml/);
  const again = await run(["test", project, "--scenario", "by-hand"]);
  assert.equal(again.code, 0, `${again.stdout}\n${again.stderr}`);
  await close();
  await program.stop();
});

test("what was done by hand goes into a scenario that is there, and into the page that edits it", async () => {
  const folder = join(scratch(), "recharge");
  cpSync(example("recharge"), folder, { recursive: true });
  const file = join(folder, "scenarios", "experiment1.yaml");
  const before = readFileSync(file, "utf8");
  const design = await serve_design(folder);
  const editor = await open_design(design.url, { file: "scenarios/experiment1.yaml" });
  await editor.page.locator('[data-entry="0"]').waitFor();

  const program = await serve_run(folder, { scenario: "experiment1", args: ["--paused"] });
  const { page, close } = await open_page(program.url);
  await open_tab(page, "Save");
  assert.equal(await page.getByTestId("scenario-into").inputValue(), "experiment1");
  await page.getByTestId("add-to-scenario").click();
  await page.getByText("nothing was done to this run by hand yet").waitFor();
  await operate(page, "step", { ticks: 3 });
  await until(async () => (await state_of(page)).tick >= 3 && (await state_of(page)).run.state === "paused", "three ticks");
  await page.locator("[data-node]", { hasText: "BatteryLevelAbove30" }).click({ button: "right" });
  await page.getByRole("menuitemcheckbox", { name: "failure" }).last().click();
  await page.locator("[data-node] .forced").waitFor();
  await open_tab(page, "Save");  // a press on the tree has closed it
  await page.getByTestId("add-to-scenario").click();
  await page.getByTestId("saved-file").waitFor();
  const after = readFileSync(file, "utf8");
  const added = after.split("\n").filter((line) => !before.split("\n").includes(line));
  assert.equal(added.length, 1, added.join("\n"));
  assert.match(added[0], /^ {2}- \{at: [\d.]+ (?:s|ms|us|ns), force: \{leaf: BatteryLevelAbove30, status: FAILURE\}\}$/);
  assert.equal(after.replace(`${added[0]}\n`, ""), before, "all else is byte for byte what it was");
  // A second time there is nothing to add.
  await page.getByTestId("add-to-scenario").click();
  await page.getByText("all that was done is in").first().waitFor();
  assert.equal(readFileSync(file, "utf8"), after);
  // Who edits the project sees the entry, as a step that can be undone.
  await editor.page.locator('[data-entry="1"]').waitFor();
  assert.match(await editor.page.locator('[data-entry="0"]').getAttribute("aria-label"), /force/);
  await until(async () => /^\S+ changed on disk$/.test(await undo_name(editor.page)), "it can be undone");
  await close();
  await program.stop();
  await editor.close();
  await design.stop();
  const checked = await run(["check", file]);
  assert.equal(checked.code, 0, checked.stdout);
});
