// A run beside the project goes on with what is edited, where its state can be taken over; else it says why not.
import assert from "node:assert/strict";
import { mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";

import { begin_run, open_beside, records, rename_node, stop_run } from "../harness/beside.mjs";
import { interventions, text, until } from "../harness/browser.mjs";
import { node } from "../harness/design.mjs";
import { run } from "../harness/program.mjs";

/** The robot is on its way for a quarter of an hour: on a slow machine too it is when the edits are applied. */
const kSlowly = { "scenarios/slowly.yaml": "override:\n  world: {motion: {speed: 0.02}, battery: {initial: 100 %, drain_standing: 0 %/s}}\nduration: 2 h\n" };

const pictures = process.env.SENTREE_PICTURES;
if (pictures) mkdirSync(pictures, { recursive: true });

test("edits are applied to a run that is paused, or refused with all reasons", async () => {
  const { folder, program, page, close } = await open_beside("recharge", "normal");
  // As slowly as it goes: it is to be paused before it is over.
  await begin_run(page, "In step with the clock");
  const at_work = page.locator('[data-testid=tree] [data-status="RUNNING"][aria-label^="GoToKitchen"]');
  await at_work.waitFor();
  await page.getByTestId("pause").click();
  await until(async () => (await text(page, "presence")) === "❚❚ Paused", "the run is paused");
  const first = await records(page);
  assert.equal(await page.getByTestId("apply").count(), 0, "there is nothing to apply");
  // Beside it, the tree that is edited says what its nodes are in it.
  await page.getByRole("button", { name: "Design", exact: true }).click();
  for (const [name, status] of [["GoToKitchen", "RUNNING"], ["AtKitchen", "FAILURE"], ["Root", "RUNNING"]]) await page.locator(`[data-testid=design-tree] [data-name="${name}"][data-status=${status}]`).waitFor();
  if (pictures) await page.screenshot({ path: join(pictures, "apply-beside.png") });

  // What is at work cannot get lost.
  await rename_node(page, "GoToKitchen", "DriveToKitchen");
  await page.getByTestId("apply").click();
  await page.getByTestId("refusals").getByText("the skill of GoToKitchen is at work, and its leaf is gone").waitFor();
  if (pictures) await page.screenshot({ path: join(pictures, "apply-later.png") });
  await page.getByRole("dialog").getByRole("button", { name: "Close" }).click();
  assert.equal(await records(page), first);
  await page.getByTestId("undo").click();
  await node(page, "GoToKitchen").waitFor();
  await page.getByTestId("apply").waitFor({ state: "visible" });

  // Another leaf, idle now, gets another name.
  await rename_node(page, "AtKitchen", "InKitchen");
  await page.getByTestId("apply").click();
  await until(async () => (await records(page)) !== first, "the run is recorded into another file");
  const second = await records(page);
  await page.getByTestId("apply").waitFor({ state: "detached" });
  await page.getByRole("button", { name: "Run", exact: true }).click();
  await page.locator('[data-testid=tree] [aria-label^="InKitchen"]').waitFor();
  await at_work.waitFor();
  assert.equal(await text(page, "presence"), "❚❚ Paused");
  // What was before is a run of its own, and one comes back from it.
  await page.getByTestId("before-edits").click();
  await page.locator('[data-testid=tree] [aria-label^="AtKitchen"]').waitFor();
  await page.getByRole("button", { name: "Show the run" }).click();
  await page.locator('[data-testid=tree] [aria-label^="InKitchen"]').waitFor();
  await page.getByRole("combobox", { name: "Speed of the run" }).selectOption("16");
  await page.getByTestId("pause").click();
  await until(async () => (await text(page, "presence")) !== "❚❚ Paused", "it goes on");
  await until(async () => (await text(page, "presence")) === "■ Ended", "the mission is over");
  assert.ok((await interventions(page)).some((one) => /reload/.test(one)), "it is said that the project is another one");
  await close();
  assert.equal(await program.stop(), 0);
  const info = await run(["info", join(folder, "runs", second)]);
  assert.equal(info.code, 0, info.stderr);
  assert.ok(info.stdout.includes(`continues ${first}`), info.stdout);
  assert.match(info.stdout, /SUCCESS/);
  // What was before is a recording like any other.
  const replayed = await run(["replay", join(folder, "runs", first)]);
  assert.equal(replayed.code, 0, replayed.stdout + replayed.stderr);
});

test("a project with errors is refused with reason and place; a run in real time goes on with the edits", async () => {
  const { folder, program, page, close } = await open_beside("recharge", "slowly", kSlowly);
  await begin_run(page, "In step with the clock");
  await until(async () => (await text(page, "presence")) === "● Live", "the run goes on");
  const file = join(folder, "mission.xml");
  const original = readFileSync(file, "utf8");
  writeFileSync(file, original.replace('location="kitchen"', 'location="kitchn"'));
  await page.getByTestId("apply").click();
  const reasons = page.getByTestId("refusals");
  await reasons.getByText('"kitchn", the location of AtKitchen, is no location or area of world/world.yaml').waitFor();
  assert.match(await reasons.innerText(), /mission\.xml:\d+/);
  const dialog = page.getByRole("dialog");
  assert.equal(await dialog.getByRole("button", { name: "Try again" }).count(), 0, "waiting would not help");
  if (pictures) await page.screenshot({ path: join(pictures, "apply-refused.png") });
  await dialog.getByRole("button", { name: "Close" }).click();
  writeFileSync(file, original);
  await page.getByTestId("apply").click();
  await page.getByTestId("apply").waitFor({ state: "detached" });
  await stop_run(page);

  await begin_run(page, "In real time");
  await page.getByTestId("records").waitFor();
  const first = await records(page);
  await rename_node(page, "AtKitchen", "InKitchen");
  await page.getByTestId("apply").click();
  await until(async () => (await records(page)) !== first, "the run is recorded into another file");
  const second = await records(page);
  await page.getByRole("button", { name: "Run", exact: true }).click();
  await page.locator('[data-testid=tree] [aria-label^="InKitchen"]').waitFor();
  assert.equal(await text(page, "presence"), "● Live");
  // It has not begun anew: the goal that it had is followed.
  await page.locator('[data-testid=tree] [data-status="RUNNING"][aria-label^="GoToKitchen"]').waitFor();
  await stop_run(page);
  await close();
  assert.equal(await program.stop(), 0);
  const info = await run(["info", join(folder, "runs", second)]);
  assert.ok(info.stdout.includes(`continues ${first}`), info.stdout);
  // In real time too, what was before behaves as recorded; what came after begins in the middle, and says so.
  const replayed = await run(["replay", join(folder, "runs", first)]);
  assert.equal(replayed.code, 0, replayed.stdout + replayed.stderr);
  const later = await run(["replay", join(folder, "runs", second)]);
  assert.equal(later.code, 3, later.stdout + later.stderr);
  assert.ok(later.stderr.includes(`replay ${first}, in which it began`), later.stderr);
});
