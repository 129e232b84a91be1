// A scenario on its timeline, sentree.yaml as a form, and a requirement as blocks: each gesture is a least edit of the text.
import assert from "node:assert/strict";
import { mkdirSync, readFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";

import { until } from "../harness/browser.mjs";
import { copy_of, drag, middle, open_design, serve_design, settled, undo_name } from "../harness/design.mjs";

const pictures = process.env.SENTREE_PICTURES;
if (pictures) mkdirSync(pictures, { recursive: true });

const shot = (page, name) => pictures && page.screenshot({ path: join(pictures, `${name}.png`) });

/** The file after it was saved. */
async function saved(page, folder, file) {
  await page.getByTestId("save").click();
  await page.locator(`[data-file="${file}"][data-dirty=false]`).waitFor();
  return readFileSync(join(folder, file), "utf8");
}

/** Lines that are not in both, as [before, after]; of the same number of lines. */
function differing(before, after) {
  const [old_lines, new_lines] = [before.split("\n"), after.split("\n")];
  assert.equal(new_lines.length, old_lines.length, after);
  return old_lines.flatMap((line, i) => (line === new_lines[i] ? [] : [[line, new_lines[i]]]));
}

async function undo_all(page) {
  for (;;) {
    if ((await undo_name(page)) === "") return;
    const count = await page.getByTestId("undo").innerText();
    await page.getByTestId("undo").click();
    await until(async () => (await page.getByTestId("undo").innerText()) !== count, "undone");
  }
}

test("a scenario's entries are dragged, added, said more of and deleted on a time axis", async () => {
  const folder = copy_of("recharge");
  const file = "scenarios/experiment1.yaml";
  const original = readFileSync(join(folder, file), "utf8");
  const program = await serve_design(folder);
  const { page, close } = await open_design(program.url, { file });
  await settled(page);
  const entry = (i) => page.locator(`[data-entry="${i}"]`);
  await entry(0).waitFor();
  assert.match(await entry(0).getAttribute("aria-label"), /^0:20\.000 call simulation\.setBatteryCharge/);
  // Below runs another one, until somebody says so.
  await page.getByTestId("run-scenario").click();
  await page.getByTestId("run-scenario").waitFor({ state: "detached" });
  assert.equal(await page.getByRole("combobox", { name: "Scenario of the shadow run" }).inputValue(), "experiment1");

  const at = await middle(entry(0).locator(".mark"));
  await drag(page, at, { x: at.x + 60, y: at.y });
  await page.mouse.up();
  await until(async () => /^set timeline\[0\]\.at to /.test(await undo_name(page)), "it was moved");
  const moved = await saved(page, folder, file);
  const [[before, after], ...more] = differing(original, moved);
  assert.deepEqual(more, []);
  const time = /at: ([\d.]+) s,/.exec(after)[1];
  assert.ok(Number(time) > 21 && Number(time) < 60, time);
  assert.equal(after.replace(`at: ${time} s`, "at: 20 s"), before);

  // A kind dragged from the bar; Escape lets it go.
  const kill = await middle(page.locator('[data-kind="kill"]'));
  const free = { x: at.x + 160, y: at.y + 45 };
  await drag(page, kill, free);
  await page.keyboard.press("Escape");
  await page.mouse.up();
  assert.equal(await page.locator("[data-entry]").count(), 1);
  await drag(page, kill, free);
  await page.mouse.up();
  await entry(1).waitFor();
  await page.getByTestId("scenario-form").getByLabel("kill", { exact: true }).fill("GoToKitchen");
  await page.keyboard.press("Enter");
  await until(async () => /kill GoToKitchen/.test(await entry(1).getAttribute("aria-label")), "it kills another part");
  await shot(page, "scenario");
  const killed = await saved(page, folder, file);
  assert.match(killed, /\n {2}- \{at: [\d.]+ s, kill: GoToKitchen\}\n/);
  assert.equal(killed.replace(/\n {2}- \{at: [\d.]+ s, kill: GoToKitchen\}/, ""), moved);

  // A part that is not there is red, with the reason.
  await page.getByTestId("scenario-form").getByLabel("kill", { exact: true }).fill("GoToKitchne");
  await page.keyboard.press("Enter");
  await page.locator('[data-entry="1"].wrong').waitFor();
  assert.match(await entry(1).getAttribute("aria-label"), /GoToKitchne/);

  // By keys, and away again.
  await page.getByTestId("scenario-timeline").focus();
  const was = await entry(1).getAttribute("aria-label");
  await page.keyboard.press("Shift+ArrowRight");
  await until(async () => (await entry(1).getAttribute("aria-label")) !== was, "a second later");
  await page.keyboard.press("Delete");
  await until(async () => (await page.locator("[data-entry]").count()) === 1, "it is gone");
  assert.equal(await saved(page, folder, file), moved);

  // What is expected, and how long it takes.
  await page.locator('[data-setting="expect.monitors.battery"] select').selectOption("undecided");
  await until(async () => (await undo_name(page)) === "set expect.monitors.battery to undecided", "another verdict is expected");
  await page.locator('[data-setting="expect.monitors.recharge"] select').selectOption("");
  await until(async () => (await undo_name(page)) === "delete expect.monitors.recharge", "none is expected any more");
  await page.locator('[data-setting="duration"] input').fill("3 min");
  await page.keyboard.press("Enter");
  await until(async () => (await undo_name(page)) === "set duration to 3 min", "it takes longer");
  const expected = differing(moved, await saved(page, folder, file));
  assert.deepEqual(expected.map(([, line]) => line.trim()), ["duration: 3 min", "monitors: {battery: undecided, never_empty: violated, turns_to_station: undecided}"]);

  await undo_all(page);
  assert.equal(await saved(page, folder, file), original);
  await close();
  await program.stop();
});

test("a scenario that cannot be read keeps its picture, and refuses gestures", async () => {
  const folder = copy_of("recharge");
  const program = await serve_design(folder);
  const { page, close } = await open_design(program.url, { file: "scenarios/experiment1.yaml" });
  await settled(page);
  await page.locator('[data-entry="0"]').waitFor();
  await page.locator(".cm-content").focus();
  await page.keyboard.press("Control+End");
  await page.keyboard.type("a: b: c");
  await page.getByTestId("broken").waitFor();
  assert.equal(await page.locator("[data-entry]").count(), 1);
  assert.ok(await page.locator('[data-kind="kill"]').isDisabled());
  for (let left = "a: b: c".length; left > 0; left -= 1) await page.keyboard.press("Backspace");
  await until(async () => (await page.getByTestId("broken").count()) === 0, "it can be read again");
  await close();
  await program.stop();
});

test("what is broken is told above a form, not over its rows; its landmarks have names of their own", async () => {
  const folder = copy_of("recharge");
  const program = await serve_design(folder);
  for (const [file, form] of [["sentree.yaml", "project-form"], ["requirements/recharge.req", "requirement-blocks"], ["scenarios/experiment1.yaml", "design-scenario"]]) {
    const { page, close } = await open_design(program.url, { file });
    await settled(page);
    // One is that of the form; the groups of files and of nodes are none.
    if (file === "sentree.yaml") await page.getByTestId(form).locator('[aria-label="Skills"]').waitFor();
    assert.ok((await page.getByRole("region", { name: "Skills", exact: true }).count()) <= 1);
    await page.locator(".cm-content").focus();
    await page.keyboard.press("Control+End");
    await page.keyboard.type(file.endsWith(".req") ? "X: never (" : "a: b: c");
    await page.getByTestId("broken").waitFor();
    const banner = await page.getByTestId("broken").boundingBox();
    const below = await page.locator(".design-form").boundingBox();
    assert.ok(banner.y + banner.height <= below.y + 1, `${form}: what is told ends at ${banner.y + banner.height}, the form begins at ${below.y}`);
    await page.keyboard.press("Control+z");
    await until(async () => (await page.getByTestId("broken").count()) === 0, "it can be read again");
    await settled(page);
    await close();
  }
  await program.stop();
});

test("sentree.yaml is a form: services, monitors, and deadlines that nest", async () => {
  const folder = copy_of("recharge");
  const file = "sentree.yaml";
  const original = readFileSync(join(folder, file), "utf8");
  const program = await serve_design(folder);
  const { page, close } = await open_design(program.url, { file });
  await settled(page);
  const lane = (name) => page.locator(`[data-deadline="${name}"]`);
  await lane("call").waitFor();
  await shot(page, "project");

  const grip = await middle(lane("call").locator(".nest-grip"));
  await drag(page, grip, { x: grip.x - 40, y: grip.y });
  await page.mouse.up();
  await until(async () => /^set deadlines\.call to \d+ ms$/.test(await undo_name(page)), "calls may take less");
  const call = Number(/\d+/.exec(await undo_name(page))[0]);
  assert.ok(call > 0 && call < 40, `${call}`);

  // What does not nest is red at once, and check says it too.
  const condition = page.locator('[data-setting="deadlines.condition"] input');
  await condition.fill("1 ms");
  await page.keyboard.press("Enter");
  await page.locator('[data-deadline="condition"][data-broken="true"]').waitFor();
  await until(async () => /error/.test(await page.getByTestId("problems").innerText()), "check says so");
  await page.getByTestId("undo").click();
  await page.locator('[data-deadline="condition"][data-broken="false"]').waitFor();

  // A service with an interface of the project, and away again.
  await page.getByLabel("Name of a new service").fill("lidar");
  const offered = await page.getByLabel("Its interface").locator("option").allInnerTexts();
  assert.ok(offered.includes("robot.thrift/Battery"), offered.join());
  await page.getByLabel("Its interface").selectOption("robot.thrift/Localization");
  await page.getByRole("button", { name: "Add the service" }).click();
  await page.locator('[data-service="lidar"]').waitFor();
  await page.locator('[data-setting="services.lidar.at"] input').fill("tcp://10.0.0.5:9090");
  await page.keyboard.press("Enter");
  await until(async () => /set services\.lidar\.at/.test(await undo_name(page)), "it has an address");
  const with_service = await saved(page, folder, file);
  assert.match(with_service, /\n {2}lidar: \{interface: robot\.thrift\/Localization, at: "tcp:\/\/10\.0\.0\.5:9090"\}\n/);
  await page.getByRole("button", { name: "Delete service lidar" }).click();
  await until(async () => (await page.locator('[data-service="lidar"]').count()) === 0, "the service is gone");
  assert.doesNotMatch(await saved(page, folder, file), /lidar/);

  await undo_all(page);
  assert.equal(await saved(page, folder, file), original);
  await close();
  await program.stop();
});

test("a requirement is blocks beside its text; what it cannot say is refused with the reason", async () => {
  const folder = copy_of("recharge");
  const file = "requirements/recharge.req";
  const original = readFileSync(join(folder, file), "utf8");
  const program = await serve_design(folder);
  const { page, close } = await open_design(program.url, { file });
  await settled(page);
  const blocks = (name) => page.locator(`section[data-requirement="${name}"]`);
  await blocks("turns_to_station").waitFor();
  await shot(page, "requirement");
  assert.equal(await blocks("turns_to_station").locator('[data-part="p"] :is(input, textarea)').inputValue(), "level < 30 % and destination = kitchen");

  await blocks("turns_to_station").locator('[data-part="bound"] :is(input, textarea)').fill("5");
  await page.keyboard.press("Enter");
  await until(async () => (await undo_name(page)) === "write bound of turns_to_station", "the bound is another");
  assert.deepEqual(differing(original, await saved(page, folder, file)).map(([, line]) => line.trim()), ["robot shall (destination = station or at(station)) within 5 ticks."]);

  // The text edits the blocks as well.
  await page.getByTestId("undo").click();
  await until(async () => (await blocks("turns_to_station").locator('[data-part="bound"] :is(input, textarea)').inputValue()) === "10", "the block follows the text");

  await blocks("never_empty").getByLabel("Pattern").selectOption("never");
  await until(async () => /never level >= 20 %/.test(await page.locator(".cm-content").innerText()), "the sentence says never");
  await blocks("never_empty").getByLabel("Scope").selectOption("after");
  await blocks("never_empty").locator('[data-part="open"] :is(input, textarea)').waitFor();
  await blocks("never_empty").locator('[data-part="open"] :is(input, textarea)').fill("destination = kitchen");
  await page.keyboard.press("Enter");
  await until(async () => /after destination = kitchen, never level >= 20 %\./.test(await page.locator(".cm-content").innerText()), "the scope begins there");

  const p = blocks("never_empty").locator('[data-part="p"] :is(input, textarea)');
  await p.fill("level >= >= 20 %");
  await page.keyboard.press("Enter");
  await until(async () => (await page.getByTestId("refused").innerText()) !== "", "it says why not");
  await until(async () => (await p.inputValue()) === "level >= 20 %", "the block is as it was");

  // Another requirement at the end, which its blocks say more of.
  await page.getByLabel("Name of a new requirement").fill("stays_full");
  await page.keyboard.press("Enter");
  await blocks("stays_full").locator('[data-part="p"] :is(input, textarea)').fill("level >= 30 %");
  await page.keyboard.press("Enter");
  await until(async () => /of stays_full/.test(await undo_name(page)), "it demands something");
  assert.match(await saved(page, folder, file), /\n\nstays_full:\n {2}always level >= 30 %\.\n$/);

  await undo_all(page);
  assert.equal(await saved(page, folder, file), original);
  await close();
  await program.stop();
});

test("skills and models of sentree.yaml, overrides and processes of a scenario, and definitions are forms too", async () => {
  const folder = copy_of("recharge");
  const program = await serve_design(folder);
  const { page, close } = await open_design(program.url, { file: "sentree.yaml" });
  await settled(page);
  const original = readFileSync(join(folder, "sentree.yaml"), "utf8");
  const type = async (setting, text) => {
    await page.locator(`[data-setting="${setting}"] input`).fill(text);
    await page.keyboard.press("Enter");
  };
  // A leaf with another chart: one entry more, and nothing else.
  await page.getByLabel("Name of a new skill").fill("BatteryLevelAbove30");
  await page.locator(".project-form").getByRole("button", { name: "Add a skill" }).click();
  await page.locator('[data-entry-row="skills.BatteryLevelAbove30"]').waitFor();
  await type("skills.BatteryLevelAbove30.file", "skills/BatteryLevelAbove-buggy.scxml");
  await until(async () => /BatteryLevelAbove-buggy/.test(await undo_name(page)), "it has another chart");
  await type("models.0.name", "platform");
  await until(async () => /name/.test(await undo_name(page)), "the model has a name");
  await shot(page, "project-skills");
  const written = await saved(page, folder, "sentree.yaml");
  assert.match(written, /\nskills:\n {2}BatteryLevelAbove30: \{file: skills\/BatteryLevelAbove-buggy\.scxml\}\n/);
  assert.match(written, /\{file: models\/robot\.scxml, serves: \[battery, navigation\], name: platform\}/);
  await page.getByRole("button", { name: "Delete skill BatteryLevelAbove30" }).click();
  await until(async () => (await page.locator('[data-entry-row="skills.BatteryLevelAbove30"]').count()) === 0, "the skill is gone");
  await undo_all(page);
  assert.equal(await saved(page, folder, "sentree.yaml"), original);

  const file = "scenarios/distributed.yaml";
  const scenario = readFileSync(join(folder, file), "utf8");
  await page.locator(`[data-file="${file}"]`).click();
  await page.locator('[data-entry-row="processes.goto"]').waitFor();
  await type("processes.goto.restarts", "3");
  await until(async () => (await undo_name(page)) === "set processes.goto.restarts to 3", "the process is started again");
  await type("override.services.battery.at", "sim");
  await until(async () => /override\.services\.battery\.at/.test(await undo_name(page)), "the battery is elsewhere");
  await shot(page, "scenario-overrides");
  const lines = differing(scenario, await saved(page, folder, file)).map(([, line]) => line.trim());
  assert.deepEqual(lines, ['goto: {skill: GoToLocation, listen: "unix:{run}/goto.sock", restarts: 3}', 'services: {battery: {at: "sim"}, navigation: {at: "{robot}"}}']);
  await undo_all(page);
  assert.equal(await saved(page, folder, file), scenario);

  const requirements = "requirements/recharge.req";
  const sentences = readFileSync(join(folder, requirements), "utf8");
  await page.locator(`[data-file="${requirements}"]`).click();
  const level = page.locator('[data-definition="level"] :is(input, textarea)');
  await level.waitFor();
  await level.fill(`${await level.inputValue()} + 0`);
  await page.keyboard.press("Enter");
  await until(async () => (await undo_name(page)) === "define level", "the definition is another");
  const [[was, is], ...more] = differing(sentences, await saved(page, folder, requirements));
  assert.deepEqual(more, []);
  assert.equal(is.replace(" + 0", ""), was);
  await undo_all(page);
  assert.equal(await saved(page, folder, requirements), sentences);
  await close();
  await program.stop();
});
