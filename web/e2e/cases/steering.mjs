// What a person can do to a run from its page, and what comes of it.
import assert from "node:assert/strict";
import { cpSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";

import { first_message, open_page, operate, text, until, verdicts } from "../harness/browser.mjs";
import { example, run, scratch, serve_run } from "../harness/program.mjs";

const state_of = (page) => first_message(page, "state");
const tab = (page, name) => page.getByRole("tab", { name, exact: false }).click();

/** Where a point of the world is in the window. */
async function place(page, [x, y]) {
  const map = page.getByTestId("map");
  const box = await map.boundingBox();
  const [scale, dx, dy] = (await map.getAttribute("data-view")).split(" ").map(Number);
  return [box.x + scale * x + dx, box.y + dy - scale * y];
}

async function pause(page) {
  await page.getByTestId("pause").click();
  await until(async () => (await text(page, "presence")).includes("Paused"), "the run is paused");
}

/** Observations of what the page did, as the program keeps them. */
const done_here = async (page) =>
  (await operate(page, "messages", { limit: 500, filter: { name: "scenario.injection" } })).messages.map((message) => JSON.stringify(message));

test("the battery slider at 10 % violates requirement 1, and its chart stands in failure", async () => {
  const program = await serve_run(example("recharge"), { scenario: "normal" });
  const { page, close } = await open_page(program.url);
  await page.getByTestId("battery-robot").fill("10");
  await page.getByTestId("violation-banner").waitFor();
  await until(async () => (await verdicts(page)).battery === "violated", "the monitor of the battery is violated");
  await page.getByTestId("chart-pick").selectOption("monitor:battery");
  await page.locator('[data-testid=chart][data-chart="monitor:battery"] [data-id=failure][data-active=true]').waitFor();
  assert.match((await done_here(page)).join("\n"), /setBatteryCharge.*studio|studio.*setBatteryCharge/);
  await close();
  await program.stop();
});

test("the robot is dragged, and obstacles come and go", async () => {
  const program = await serve_run(example("recharge"), { scenario: "normal" });
  const { page, close } = await open_page(program.url);
  await pause(page);
  const before = (await state_of(page)).robots.robot.pose;
  const from = await place(page, before);
  const to = await place(page, [8.2, 4.9]);
  await page.mouse.move(...from);
  await page.mouse.down();
  await page.mouse.move(from[0] + 20, from[1] - 10);
  await page.mouse.move(...to, { steps: 4 });
  await page.mouse.up();
  await until(async () => {
    const [x, y] = (await state_of(page)).robots.robot.pose;
    return Math.hypot(x - 8.2, y - 4.9) < 0.2;
  }, "the robot stands where it was put");

  await page.getByTestId("tool-obstacle").click();
  await page.mouse.click(...(await place(page, [5, 8])));
  const added = await until(async () => (await state_of(page)).obstacles[0], "there is an obstacle");
  assert.ok(Math.hypot(added.circle[0] - 5, added.circle[1] - 8) < 0.2);
  await page.getByTestId("tool-obstacle").click();
  await page.mouse.click(...(await place(page, [5, 8])), { button: "right" });
  await page.getByRole("menuitem", { name: `Remove ${added.name}` }).click();
  await until(async () => (await state_of(page)).obstacles.length === 0, "the obstacle is gone");

  await page.getByTestId("map").focus();
  await page.keyboard.press("t");
  await page.mouse.click(...(await place(page, [2.7, 7.5])));
  await until(async () => (await done_here(page)).some((message) => message.includes("gotoTargetByAbsoluteLocation")), "a goal was set by hand");
  await close();
  await program.stop();
});

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

  await tab(page, "Standing");
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

test("a falsified reply reaches the skill; services are called with a form made from their interface", async () => {
  const program = await serve_run(example("recharge"), { scenario: "normal" });
  const { page, close } = await open_page(program.url);
  await tab(page, "Call");
  await page.getByTestId("call-service").selectOption("battery");
  await page.getByTestId("call-method").selectOption("getBatteryCharge");
  await page.getByRole("button", { name: "Call", exact: true }).click();
  await until(async () => Number(await page.locator(".outcome").innerText()) > 50, "the form shows the answer");

  await tab(page, "Faults");
  await page.getByLabel("Member").selectOption("percentage");
  await page.getByLabel("Value").fill("much");
  assert.ok(await page.getByRole("button", { name: "Falsify" }).isDisabled(), "what is no number cannot be sent");
  await page.getByLabel("Value").fill("0.15");
  await page.getByRole("button", { name: "Falsify" }).click();
  await until(async () => (await verdicts(page)).battery === "violated", "the monitor sees the falsified reply");
  const battery = (await state_of(page)).robots.robot.battery;
  assert.ok(battery.percentage > 0.5, "the battery itself is full");
  await close();
  await program.stop();
});

test("a skill is killed and restarted", async () => {
  const program = await serve_run(example("recharge"), { scenario: "normal" });
  const { page, close } = await open_page(program.url);
  await tab(page, "Parts");
  await page.getByRole("button", { name: "Kill WaitForUser" }).click();
  await page.getByRole("row", { name: /WaitForUser/ }).getByText("killed").waitFor();
  await page.getByRole("button", { name: "Restart WaitForUser" }).click();
  await page.getByRole("row", { name: /WaitForUser/ }).getByText("thread").waitFor();
  const seen = (await done_here(page)).join("\n");
  assert.match(seen, /kill/);
  assert.match(seen, /restart/);
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
  await tab(page, "Save");
  await page.getByTestId("scenario-name").fill("by-hand");
  await page.getByTestId("save-scenario").click();
  const file = await page.getByTestId("saved-file").innerText();
  const again = await run(["test", file]);
  assert.equal(again.code, 0, `${again.stdout}\n${again.stderr}`);
  await close();
  await program.stop();
});

test("what cannot be steered says why: the past, and a run that has ended", async () => {
  const program = await serve_run(example("recharge"), { scenario: "normal" });
  const { page, close } = await open_page(program.url);
  assert.equal(await page.getByTestId("why-not").count(), 0);
  await page.keyboard.press(",");
  await until(async () => /past/.test(await text(page, "why-not")), "the past cannot be changed");
  assert.ok(await page.getByTestId("battery-robot").isDisabled());
  assert.equal(await page.getByTestId("tool-goal").getAttribute("aria-disabled"), "true");
  await page.keyboard.press("l");
  await page.getByTestId("why-not").waitFor({ state: "detached" });
  await operate(page, "stop");
  await until(async () => /ended/.test((await page.getByTestId("why-not").count()) ? await text(page, "why-not") : ""), "a run that has ended cannot be steered");
  await close();
  await program.stop();
});
