// What a person can do to a run from its page, and what comes of it.
import assert from "node:assert/strict";
import { test } from "node:test";

import { interventions, open_page, open_tab, operate, place, state_of, text, until, verdicts } from "../harness/browser.mjs";
import { example, serve_run } from "../harness/program.mjs";

test("the battery slider at 10 % violates requirement 1, and its chart stands in failure", async () => {
  const program = await serve_run(example("recharge"), { scenario: "normal" });
  const { page, close } = await open_page(program.url);
  await page.getByTestId("battery-robot").fill("10");
  await page.getByTestId("violation-banner").waitFor();
  await until(async () => (await verdicts(page)).battery === "violated", "the monitor of the battery is violated");
  await page.getByTestId("chart-pick").selectOption("monitor:battery");
  await page.locator('[data-testid=chart][data-chart="monitor:battery"] [data-id=failure][data-active=true]').waitFor();
  assert.match((await interventions(page)).join("\n"), /setBatteryCharge.*studio|studio.*setBatteryCharge/);
  await close();
  await program.stop();
});

test("the robot is dragged, and obstacles come and go", async () => {
  const program = await serve_run(example("recharge"), { scenario: "normal" });
  const { page, close } = await open_page(program.url);
  // So slow that the robot is still where it was when it is pressed on, however slow the machine.
  await operate(page, "factor", { value: 0.1 });
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
  await until(async () => (await interventions(page)).some((message) => message.includes("gotoTargetByAbsoluteLocation")), "a goal was set by hand");
  await close();
  await program.stop();
});

test("a robot is plugged in at a station, and on its way the page says why not", async () => {
  const program = await serve_run(example("recharge"), { scenario: "normal" });
  const { page, close } = await open_page(program.url);
  const plug = page.getByRole("button", { name: "Plug in" });
  await until(async () => (await text(page, "plug-robot")).includes("not at a station (dock)"), "the page says why");
  assert.ok(await plug.isDisabled());
  // With so little charge the robot stays there and waits for somebody.
  await operate(page, "intervene", { call: "simulation.setBatteryCharge", args: { percent: 28 } });
  await operate(page, "intervene", { call: "simulation.setRobotPose", args: { pose: { x: 8.2, y: 5.2, theta: Math.PI / 2 } } });
  await until(async () => (await text(page, "plug-robot")).includes("at dock, not plugged in"), "the robot is at the station");
  await plug.click();
  await until(async () => (await text(page, "plug-robot")).includes("plugged in at dock"), "it is plugged in");
  await until(async () => (await state_of(page)).robots.robot.battery.charging, "it charges");
  await page.getByRole("button", { name: "Unplug" }).click();
  await until(async () => (await text(page, "plug-robot")).includes("not plugged in"), "it is unplugged");
  await close();
  await program.stop();
});

test("a service is called with a form made from its interface", async () => {
  const program = await serve_run(example("recharge"), { scenario: "normal" });
  const { page, close } = await open_page(program.url);
  await open_tab(page, "Call");
  await page.getByTestId("call-service").selectOption("battery");
  await page.getByTestId("call-method").selectOption("getBatteryCharge");
  await page.getByRole("button", { name: "Call", exact: true }).click();
  await until(async () => Number(await page.locator(".outcome").innerText()) > 50, "the form shows the answer");
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
  await operate(page, "intervene", { stop: "mission" });
  await until(async () => /ended/.test((await page.getByTestId("why-not").count()) ? await text(page, "why-not") : ""), "a run that has ended cannot be steered");
  await close();
  await program.stop();
});
