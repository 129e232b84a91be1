// The run once more from its page; and what asks before it does something.
import assert from "node:assert/strict";
import { readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";

import { first_message, open_page, operate, state_of, text, until } from "../harness/browser.mjs";
import { copy_of } from "../harness/design.mjs";
import { example, serve_run } from "../harness/program.mjs";

const hello_of = (page) => first_message(page, "hello");
/** What another run than that of `boot` says of itself, at the same address. */
const other_run = (page, boot) =>
  until(async () => {
    const now = await hello_of(page).catch(() => null);
    return now && now.boot !== boot ? now : null;
  }, "there is another run");

test("a run that has ended begins again, with the same seed, and then as another scenario", async () => {
  const program = await serve_run(example("recharge"), { scenario: "experiment1", args: ["--clock", "virtual", "--factor", "1000"] });
  const { page, close } = await open_page(program.url, { lost_connections: true });
  await until(async () => (await text(page, "presence")) === "■ Ended", "the run has ended");
  const before = await hello_of(page);
  // Another page looks at the past meanwhile.
  const other = await open_page(program.url, { lost_connections: true });
  await other.page.getByTestId("violation-moment").click();
  await other.page.getByTestId("past-strip").waitFor();
  await page.getByRole("button", { name: "Run again" }).click();
  await page.getByRole("menuitem", { name: "The same once more" }).click();
  const after = await other_run(page, before.boot);
  assert.equal(after.seed, before.seed);
  assert.equal(after.title, before.title);
  // Until then the page shows the end of the run before.
  await page.locator(`header[data-boot="${after.boot}"]`).waitFor();
  await until(async () => (await text(page, "presence")) === "■ Ended", "the page shows it, to its end");
  await other.page.locator(`header[data-boot="${after.boot}"]`).waitFor();
  await until(async () => (await text(other.page, "presence")) === "■ Ended", "so does the other page, to its end");
  await page.getByRole("button", { name: "Run again" }).click();
  await page.getByRole("menuitemcheckbox", { name: "normal" }).click();
  await until(async () => (await hello_of(page).catch(() => null))?.title === "normal", "the other scenario runs");
  await until(async () => (await page.locator("h1").innerText()).includes("normal"), "the page shows it");
  await until(async () => (await other.page.locator("h1").innerText()).includes("normal"), "the other page shows it");
  await other.close();
  await close();
  await program.stop();
});

test("with another seed it is another run, which can be repeated", async () => {
  const folder = copy_of("recharge");
  const world = join(folder, "world", "world.yaml");
  const text_of_world = readFileSync(world, "utf8");
  assert.match(text_of_world, /odometry: +\{noise: 0\}/);
  writeFileSync(world, text_of_world.replace(/odometry: +\{noise: 0\}/, "odometry: {noise: 0.05}"));
  const program = await serve_run(folder, { scenario: "experiment1", args: ["--clock", "virtual", "--factor", "1000"] });
  const { page, close } = await open_page(program.url, { lost_connections: true });
  /** What is left to chance is the odometry: where the robot believes to be when the run ends. */
  const ended = async (before) => {
    const hello = await other_run(page, before?.boot);
    await page.locator(`header[data-boot="${hello.boot}"]`).waitFor();
    await until(async () => (await text(page, "presence")) === "■ Ended", "it has ended");
    return { ...hello, believes: (await state_of(page)).robots.robot.estimate };
  };
  const again = async (item) => {
    await page.getByRole("button", { name: "Run again" }).click();
    await page.getByRole("menuitem", { name: item }).click();
  };
  const first = await ended(null);
  await again("With another seed");
  const second = await ended(first);
  assert.notEqual(second.seed, first.seed);
  assert.equal(second.title, first.title);
  assert.notDeepEqual(second.believes, first.believes);
  await again("The same once more");
  const third = await ended(second);
  assert.equal(third.seed, second.seed);
  assert.deepEqual(third.believes, second.believes);
  await close();
  await program.stop();
});

test("stopping asks; Space pauses wherever the focus is; a goal by hand says what it replaces", async () => {
  const program = await serve_run(example("recharge"), { scenario: "normal" });
  const { page, close } = await open_page(program.url);
  await page.getByRole("button", { name: "Stop", exact: true }).click();
  await page.getByRole("dialog").getByRole("button", { name: "Cancel" }).click();
  assert.equal((await state_of(page)).run.state, "running");

  // The focus is on a button now; then on the tree.
  await page.getByTestId("tool-goal").focus();
  await page.keyboard.press("Space");
  await until(async () => (await state_of(page)).run.state === "paused", "Space pauses, and does not press the button");
  assert.equal(await page.getByTestId("goal-hint").count(), 0);
  await page.getByTestId("tree").focus();
  await page.keyboard.press("Space");
  await until(async () => (await state_of(page)).run.state === "running", "Space resumes");
  await page.keyboard.press("Control+f");
  await page.keyboard.type("go to");
  assert.equal(await page.locator("#mission-search").inputValue(), "go to");

  await page.getByTestId("tool-goal").click();
  assert.match(await page.getByTestId("goal-hint").innerText(), /replaces the goal/);
  await page.getByTestId("tool-goal").click();
  // So does the menu of a place.
  await page.getByTestId("map").focus();
  await page.keyboard.press("Enter");
  assert.match((await page.getByRole("menu").innerText()).replace(/\s+/g, " "), /In place of the goal that the mission has set; it is not told.* Send the robot here$/);
  await page.keyboard.press("Escape");

  // What is open above the bar goes by Escape, wherever the focus is, and by a press elsewhere.
  const drawer = page.locator(".steer-drawer");
  await page.getByRole("tab", { name: "Faults" }).click();
  await drawer.waitFor();
  await drawer.getByTestId("fault-kind").click();
  await page.keyboard.press("Escape");
  await drawer.waitFor();
  await page.evaluate(() => document.activeElement.blur());
  await page.keyboard.press("Escape");
  await drawer.waitFor({ state: "detached" });
  await page.getByRole("tab", { name: "Call" }).click();
  await drawer.waitFor();
  await page.locator("h1").click();
  await drawer.waitFor({ state: "detached" });

  // What is done to a paused world is seen at once.
  await operate(page, "pause");
  await until(async () => /Paused/.test(await text(page, "presence")), "the run is paused");
  await page.getByTestId("battery-robot").fill("60");
  await until(async () => (await page.locator(".charge-value").innerText()).startsWith("60"), "the page shows the charge while the run is paused");
  assert.equal((await state_of(page)).run.state, "paused");
  // A key that is held moves the slider on, and is one step.
  await page.getByTestId("battery-robot").focus();
  for (let i = 0; i < 5; i += 1) await page.keyboard.down("ArrowLeft");
  await page.keyboard.up("ArrowLeft");
  await until(async () => Math.round(100 * (await state_of(page)).robots.robot.battery.percentage) === 55, "five presses are 5 %");
  await page.getByTestId("steer-undo").click();
  await until(async () => Math.round(100 * (await state_of(page)).robots.robot.battery.percentage) === 60, "they are taken back at once");

  // It is taken back the same way, the newest first; a goal that was told is not.
  const map = await page.getByTestId("map").boundingBox();
  await page.getByTestId("tool-obstacle").click();
  await page.mouse.click(map.x + map.width / 2, map.y + map.height / 2);
  await until(async () => (await state_of(page)).obstacles.length === 1, "the obstacle stands in the paused world");
  await page.keyboard.press("Escape");
  // Also by a page that was loaded anew.
  await page.reload();
  await page.getByTestId("tree").waitFor();
  assert.match(await page.getByTestId("steer-undo").getAttribute("title"), /Take back: obstacle-1 added/);
  await page.keyboard.press("Control+z");
  await until(async () => (await state_of(page)).obstacles.length === 0, "it is gone again");
  await page.getByTestId("steer-undo").click();
  await until(async () => (await state_of(page)).robots.robot.battery.percentage > 0.95, "the battery is as it was");
  await page.getByTestId("steer-undo").waitFor({ state: "detached" });
  assert.equal((await state_of(page)).run.state, "paused");
  await close();
  await program.stop();
});
