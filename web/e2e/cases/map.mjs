// The map: what a particle filter believes, following, and several robots, each sent through its own services.
import assert from "node:assert/strict";
import { cpSync, mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";

import { open_page, operate, place, state_of, text, until, view_of } from "../harness/browser.mjs";
import { example, scratch, serve_run } from "../harness/program.mjs";

/** The map as it is drawn now, under a name. Resolves to the number of pixels that are not as in the picture named `other`. */
const picture = (page, name, other) =>
  page.evaluate(
    ([name, other]) => {
      const canvas = document.querySelector("[data-testid=map]");
      const copy = Object.assign(document.createElement("canvas"), { width: canvas.width, height: canvas.height }).getContext("2d", { willReadFrequently: true });
      copy.drawImage(canvas, 0, 0);
      const pixels = new Uint32Array(copy.getImageData(0, 0, canvas.width, canvas.height).data.buffer);
      const pictures = (window.pictures ??= {});
      const before = pictures[other] ?? [];
      pictures[name] = pixels;
      return pixels.reduce((count, pixel, i) => count + (pixel === before[i] ? 0 : 1), 0);
    },
    [name, other],
  );

test("the particles of a robot that is lost are drawn, and can be left out", async () => {
  const project = join(scratch(), "recharge");
  cpSync(example("recharge"), project, { recursive: true });
  const world = join(project, "world/world.yaml");
  writeFileSync(world, readFileSync(world, "utf8").replace("method: odometry", "method: amcl"));
  const program = await serve_run(project, { scenario: "normal" });
  const { page, close } = await open_page(program.url);
  // Put elsewhere, the filter looks for itself all over the house.
  await operate(page, "intervene", { call: "simulation.setRobotPose", args: { pose: { x: 8.7, y: 2.5, theta: 0 } } });
  const width = (places) => Math.max(...places) - Math.min(...places);
  await until(async () => width(((await state_of(page)).robots.robot.particles ?? []).map(([x]) => x)) > 10, "there are particles everywhere");
  await operate(page, "pause");
  await until(async () => /Paused/.test(await text(page, "presence")), "the page has seen the pause");
  await until(async () => (await picture(page, "shown", "shown")) === 0, "the map of a paused run stands still");
  const layers = async () => {
    await page.getByRole("button", { name: "View of the map" }).click();
    await page.getByRole("menuitemcheckbox", { name: /Particles/ }).click();
  };
  await layers();
  await until(async () => (await picture(page, "left out", "shown")) > 30, "the particles are left out");
  await layers();
  await until(async () => (await picture(page, "again", "shown")) === 0, "they are drawn as before");
  await close();
  await program.stop();
});

test("following keeps the robot in the middle until somebody shows all", async () => {
  const program = await serve_run(example("recharge"), { scenario: "normal" });
  const { page, close } = await open_page(program.url);
  await until(async () => (await state_of(page)).robots.robot?.pose, "the robot is somewhere");
  const [whole] = await view_of(page);
  const follow = () => page.getByRole("menuitemcheckbox", { name: "Follow the robot" });
  await page.getByRole("button", { name: "View of the map" }).click();
  await follow().click();
  await until(async () => (await view_of(page))[0] > whole, "the map is nearer");
  await operate(page, "pause");
  const box = await page.getByTestId("map").boundingBox();
  const off = async () => {
    const [x, y] = await place(page, (await state_of(page)).robots.robot.pose);
    return Math.hypot(x - box.x - box.width / 2, y - box.y - box.height / 2);
  };
  await until(async () => (await off()) < 4, "the robot is in the middle");
  await page.getByTestId("map").focus();
  await page.keyboard.press("0");
  await until(async () => (await view_of(page))[0] === whole, "all is shown again");
  await page.getByRole("button", { name: "View of the map" }).click();
  assert.equal(await follow().getAttribute("aria-checked"), "false");
  await close();
  await program.stop();
});

/** Two robots that stand, and services whose names do not say whose they are. */
function two_robots() {
  const project = scratch();
  mkdirSync(join(project, "skills"));
  cpSync(join(example("recharge"), "world"), join(project, "world"), { recursive: true });
  writeFileSync(
    join(project, "world.yaml"),
    "map: world/house.yaml\nrobots: {left: {start: west}, right: {start: east}}\nlocations: {west: [2, 5, 0], east: [14, 5, 180 deg]}\n",
  );
  writeFileSync(
    join(project, "sentree.yaml"),
    "mission: {file: mission.xml}\nworld: world.yaml\nservices:\n  navigation: {interface: robot.thrift/Navigation}\n  navigation2: {interface: robot.thrift/Navigation, robot: right}\n",
  );
  writeFileSync(join(project, "mission.xml"), `<root BTCPP_format="4"><BehaviorTree ID="Main"><Action ID="Stand"/></BehaviorTree></root>`);
  writeFileSync(join(project, "skills/Stand.scxml"), `<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" initial="stand"><state id="stand"><transition event="halt" target="halted"/></state><final id="halted"/></scxml>`);
  return project;
}

test("of several robots each is followed, put and sent by itself", async () => {
  const program = await serve_run(two_robots());
  const { page, close } = await open_page(program.url);
  await until(async () => Object.keys((await state_of(page)).robots).length === 2, "there are two robots");
  assert.equal(await page.getByTestId(/^battery-/).count(), 2);

  await page.mouse.click(...(await place(page, [13, 5])), { button: "right" });
  await page.getByRole("menuitem", { name: "Send right here" }).click();
  await until(async () => (await state_of(page)).robots.right.pose[0] < 13.8, "the right one drives");
  assert.equal((await state_of(page)).robots.left.pose[0], 2, "the left one stands");

  await page.mouse.click(...(await place(page, [4, 5])), { button: "right" });
  await page.getByRole("menuitem", { name: "Put left here" }).click();
  await until(async () => Math.abs((await state_of(page)).robots.left.pose[0] - 4) < 0.2, "the left one was put there");

  for (const name of ["left", "right"]) {
    await page.getByRole("button", { name: "View of the map" }).click();
    await page.getByRole("menuitemcheckbox", { name: `Follow ${name}` }).click();
  }
  // With the tool, the followed one is sent.
  await page.getByTestId("tool-goal").click();
  const box = await page.getByTestId("map").boundingBox();
  await page.mouse.click(box.x + box.width / 2 - 30, box.y + box.height / 2);
  const calls = await until(async () => {
    const { messages } = await operate(page, "messages", { limit: 500, filter: { name: "scenario.injection" } });
    const goals = messages.map((message) => JSON.stringify(message.data)).filter((data) => data.includes("gotoTargetByAbsoluteLocation"));
    return goals.length === 2 ? goals : null;
  }, "a second goal was set");
  for (const call of calls) assert.match(call, /navigation2/);
  await close();
  await program.stop();
});
