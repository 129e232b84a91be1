// The world is edited on its map: only the numbers concerned are written, comments stay, and what check finds is red.
import assert from "node:assert/strict";
import { mkdirSync, readFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";

import { until } from "../harness/browser.mjs";
import { contents, copy_of, drag, middle, open_design, serve_design, settled, undo_name } from "../harness/design.mjs";
import { run } from "../harness/program.mjs";

const pictures = process.env.SENTREE_PICTURES;
if (pictures) mkdirSync(pictures, { recursive: true });

test("places are dragged, turned and moved by keys, as least edits of the text; a place in a wall is red", async () => {
  const folder = copy_of("recharge");
  const file = join(folder, "world", "world.yaml");
  const original = readFileSync(file, "utf8");
  const program = await serve_design(folder);
  const { page, close } = await open_design(program.url, { file: "world/world.yaml" });
  await settled(page);
  const spot = (id) => page.locator(`[data-spot="${id}"]:not([data-heading])`);
  await spot("location study").waitFor();
  if (pictures) await page.screenshot({ path: join(pictures, "world.png") });
  const saved = async () => {
    await page.getByTestId("save").click();
    await page.locator('[data-file="world/world.yaml"][data-dirty=false]').waitFor();
    return readFileSync(file, "utf8");
  };
  const at = await middle(spot("location study").locator("circle"));
  await drag(page, at, { x: at.x + 30, y: at.y + 12 });
  await page.mouse.up();
  await until(async () => (await undo_name(page)) === "move study", "it was moved");
  const moved = await saved();
  const [before, after] = [original.split("\n"), moved.split("\n")];
  assert.equal(after.length, before.length);
  const differing = before.flatMap((line, i) => (line === after[i] ? [] : [[line, after[i]]]));
  assert.equal(differing.length, 1);
  const numbers = /^ {2}study: {3}\[([\d.]+), ([\d.]+), 90 deg\]$/.exec(differing[0][1]);
  assert.ok(numbers && Number(numbers[1]) > 2.7 && Number(numbers[2]) < 7.5, differing[0][1]);

  // The end of its heading.
  const heading = await middle(page.locator('[data-spot="location study"][data-heading]'));
  const centre = await middle(spot("location study").locator("circle"));
  await drag(page, heading, { x: centre.x + 60, y: centre.y });
  await page.mouse.up();
  await until(async () => (await undo_name(page)) === "turn study", "it was turned");
  assert.match(await saved(), /study: {3}\[[\d.]+, [\d.]+, 0 deg\]/);

  // A corner, by keys.
  await spot("area corridor 1").locator("circle").click();
  await page.getByTestId("design-world").focus();
  await page.keyboard.press("Shift+ArrowUp");
  await until(async () => (await undo_name(page)) === "move corridor, corner 1", "the corner was moved");
  assert.match(await saved(), /corners: \[\[0\.1, 4\.8\], \[15\.9, 4\.3\]/);

  // An obstacle that was not there, put elsewhere and made larger; a station's tolerance.
  await page.getByLabel("Name of a new obstacle").fill("crate");
  await page.keyboard.press("Enter");
  await spot("obstacle crate").waitFor();
  await until(async () => /^set obstacles\.crate/.test(await undo_name(page)), "it was added");
  for (const [id, name, by] of [["obstacle crate", "move crate", 40], ["obstacle crate radius", "change radius of crate", 12], ["station dock tolerance", "change tolerance of dock", 12]]) {
    const from = await middle(spot(id).locator("circle"));
    await drag(page, from, { x: from.x + by, y: from.y });
    await page.mouse.up();
    await until(async () => (await undo_name(page)) === name, `${name} was done`);
  }
  const more = await saved();
  const crate = /^obstacles:\n {2}crate: \{pose: \[([\d.]+), ([\d.]+)\], radius: ([\d.]+)\}$/m.exec(more);
  assert.ok(crate && Number(crate[3]) > 0.25, more);
  assert.ok(Number(/^ {2}dock: \{pose: station, linear_tolerance: ([\d.]+), angular_tolerance: 0.35\}$/m.exec(more)?.[1]) > 0.5, more);
  await until(() => page.locator("[data-testid=problems]").innerText().then((said) => said.includes("no problems")), "it is a world that can be run");

  // Out of the house: what check says of it is shown at the place.
  await spot("location bedroom").locator("circle").click();
  await page.getByTestId("design-world").focus();
  const label = () => spot("location bedroom").getAttribute("aria-label");
  for (let i = 0; i < 6; i += 1) {
    const was = await label();
    await page.keyboard.press("Shift+ArrowDown");
    await until(async () => (await label()) !== was, "it has moved");
  }
  await page.locator('[data-spot="location bedroom"].wrong').waitFor();
  if (pictures) await page.screenshot({ path: join(pictures, "world-wrong.png") });

  await saved();  // so that no step comes while steps are undone
  for (;;) {
    const name = await undo_name(page);
    if (name === "") break;
    const count = await page.getByTestId("undo").innerText();
    await page.getByTestId("undo").click();
    await until(async () => (await page.getByTestId("undo").innerText()) !== count, "undone");
  }
  await page.getByTestId("save").click();
  await page.locator('[data-file="world/world.yaml"][data-dirty=false]').waitFor();
  assert.equal(readFileSync(file, "utf8"), original);
  await close();
  await program.stop();
});

test("a world that cannot be read keeps its last picture, dimmed", async () => {
  const program = await serve_design(copy_of("recharge"));
  const { page, close } = await open_design(program.url, { file: "world/world.yaml" });
  await settled(page);
  await page.locator('[data-spot="location study"]').first().waitFor();
  await page.locator(".cm-content").focus();
  await page.keyboard.press("Control+End");
  await page.keyboard.type("locations: {");
  await page.getByTestId("broken").waitFor();
  const opacity = (selector) => page.locator(selector).evaluate((element) => Number(getComputedStyle(element).opacity));
  assert.ok((await page.locator("[data-spot]").count()) > 0);
  assert.ok((await opacity('[data-testid="design-world"] > g')) < 0.5 && (await opacity(".world-plan")) < 0.5);
  await close();
  await program.stop();
});

test("a place gets another name wherever it is named, as one step; the project behaves as before", async () => {
  const folder = copy_of("recharge");
  const kScenarios = ["experiment1", "experiment2", "no-path", "normal", "recharge", "shield", "unshielded"];
  const said = async () => {
    const checked = await run(["check", folder]);
    assert.equal(checked.code, 0, checked.stdout + checked.stderr);
    const tested = await run(["test", folder, ...kScenarios.flatMap((name) => ["--scenario", name])]);
    assert.equal(tested.code, 0, tested.stdout + tested.stderr);
    // But for how long it took.
    return [checked.stdout, tested.stdout.replace(/ in [\d.]+ s/g, "")];
  };
  const before = await said();
  const program = await serve_design(folder);
  const { page, close } = await open_design(program.url, { file: "world/world.yaml" });
  await settled(page);
  const original = contents(folder);
  const spot = (id) => page.locator(`[data-spot="${id}"]:not([data-heading])`);
  await spot("location station").locator("circle").click();
  await page.keyboard.press("F2");
  const field = page.getByLabel("Another name of station");
  await field.fill("battery");
  if (pictures) await page.screenshot({ path: join(pictures, "world-rename.png") });
  await page.keyboard.press("Enter");
  await page.getByText('"battery" is the name of a service too').waitFor();
  await field.fill("charger");
  await page.keyboard.press("Enter");
  await spot("location charger").waitFor();
  await until(async () => (await undo_name(page)) === "rename station to charger", "it is one step");
  await settled(page);
  // An area, by its name on the map.
  await page.locator('text[data-place="kitchen_area"]').dblclick();
  await page.getByLabel("Another name of kitchen_area").fill("galley");
  await page.keyboard.press("Enter");
  await page.locator('text[data-place="galley"]').waitFor();
  await page.getByTestId("save").click();
  await until(async () => (await page.locator("[data-file][data-dirty=true]").count()) === 0, "all is saved");
  const renamed = contents(folder);
  const changed = Object.keys(renamed).filter((file) => renamed[file] !== original[file]);
  assert.deepEqual(changed.sort(), ["mission.xml", "models/robot.scxml", "monitors/recharge.scxml", "monitors/shield.scxml", "requirements/published.req", "requirements/recharge.req", "world/world.yaml"]);
  assert.deepEqual(await said(), before);
  await page.getByTestId("undo").click();
  await until(async () => (await undo_name(page)) === "rename station to charger", "one was undone");
  await page.getByTestId("undo").click();
  await spot("location station").waitFor();
  await page.getByTestId("save").click();
  await until(async () => (await page.locator("[data-file][data-dirty=true]").count()) === 0, "all is saved");
  assert.deepEqual(contents(folder), original);
  await close();
  await program.stop();
});
