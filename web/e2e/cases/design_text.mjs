// A project's text and its pictures keep in step, whoever writes: the page, another editor, or undo.
import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { appendFileSync, readFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";

import { until } from "../harness/browser.mjs";
import { contents, copy_of, drag, middle, node, open_design, select_word, serve_design, settled, undo_name } from "../harness/design.mjs";

for (const [width, height] of [[1440, 900], [1366, 768], [1024, 700]]) test(`a slip is marked at the node and in the text, and one click mends it, at ${width}×${height}`, async () => {
  const folder = copy_of("recharge");
  const program = await serve_design(folder);
  const { page, close } = await open_design(program.url, { width, height });
  await node(page, "BatteryLevelAbove30").waitFor();
  await settled(page);
  await select_word(page, 'threshold="30"', "threshold");
  const began = Date.now();
  await page.keyboard.type("thresold");
  await page.locator('[data-name="BatteryLevelAbove30"][data-errors="1"]').waitFor();
  await page.locator(".cm-lintRange-error").waitFor();
  console.log(`# edit to marks: ${Date.now() - began} ms, typing included`);
  // The file is as it was: nothing is saved.
  assert.match(readFileSync(join(folder, "mission.xml"), "utf8"), /threshold="30"/);
  await page.locator('[data-file="mission.xml"][data-dirty=true]').waitFor();
  await page.getByTestId("problems").click();
  await page.locator(".problems").getByRole("button", { name: "Write “threshold”" }).click();
  await page.locator('[data-name="BatteryLevelAbove30"][data-errors="0"]').waitFor();
  await until(async () => (await page.locator(".cm-lintRange-error").count()) === 0, "the mark is gone");
  assert.equal(await undo_name(page), "write threshold");
  // As it was, so nothing is left to save.
  await page.locator('[data-file="mission.xml"][data-dirty=false]').waitFor();

  // What is moved in the picture is where the caret stands.
  const from = await middle(node(page, "WaitForUser"));
  const to = await middle(node(page, "BatteryNotRecharging"));
  await drag(page, from, { x: to.box.x + to.box.width + 6, y: to.y });
  await page.mouse.up();
  await until(async () => (await undo_name(page)) === "move WaitForUser under NoNeed", "the node has moved");
  await until(async () => /WaitForUser/.test(await page.locator(".cm-activeLine").innerText()), "the caret is there");
  await page.keyboard.press("Control+z");
  await until(async () => (await undo_name(page)) === "write threshold", "it is back");
  await page.keyboard.press("Control+z");
  await page.keyboard.press("Control+z");
  await until(async () => (await undo_name(page)) === "", "everything is undone");
  await page.getByTestId("save").isDisabled();
  await close();
  await program.stop();
});

test("a text that is opened shows what has been chosen in the picture alone", async () => {
  const program = await serve_design(copy_of("recharge"));
  const { page, close } = await open_design(program.url);
  const look = (name) => page.getByRole("button", { name, exact: true }).click();
  await look("Picture");
  await page.locator(".code").waitFor({ state: "detached" });
  await node(page, "GoToStation").click();
  await look("Both");
  await page.locator(".cm-activeLine", { hasText: 'name="GoToStation"' }).waitFor();
  await look("Picture");
  await page.locator(".code").waitFor({ state: "detached" });
  await page.locator('[data-file="skills/GoToLocation.scxml"]').click();
  await page.locator('[data-testid=design-chart] [data-id="moving"] .name').first().click();
  await look("Text");
  await page.locator(".cm-activeLine", { hasText: 'id="moving"' }).waitFor();
  await close();
  await program.stop();
});

test("a caret at the end of a line chooses what ends there, in trees and charts", async () => {
  const program = await serve_design(copy_of("recharge"));
  const { page, close } = await open_design(program.url);
  await node(page, "Root").waitFor();
  const to_end = async (line) => {
    await page.locator(".cm-line", { hasText: line }).first().click();
    await page.keyboard.press("End");
  };
  await to_end('name="BatteryNotRecharging"');
  await page.locator('[data-testid=design-tree] [data-name="BatteryNotRecharging"][aria-selected=true]').waitFor();
  await page.locator('[data-file="skills/BatteryLevelAbove.scxml"]').click();
  await page.locator(".code[data-file='skills/BatteryLevelAbove.scxml']").waitFor();
  await to_end('<state id="asking"');
  await until(async () => (await page.locator("#design-state").inputValue()) === "asking", "its state is chosen");
  await to_end('error error" target="failure"');
  await page.locator("#transition-event").waitFor();
  assert.equal(await page.locator("#transition-event").inputValue(), "battery.getBatteryState.error error");
  await to_end('<final id="success"');
  await until(async () => (await page.locator("#design-state").inputValue()) === "success", "and the state that is final");
  await close();
  await program.stop();
});

test("what was said of a lost connection goes when the program is back", async () => {
  const folder = copy_of("recharge");
  const program = await serve_design(folder);
  const { page, close } = await open_design(program.url);
  await node(page, "Root").waitFor();
  await settled(page);
  await program.stop("SIGKILL");
  await page.locator(".strip.lost").waitFor();
  await page.locator(".cm-line", { hasText: 'name="Root"' }).click();
  await page.keyboard.press("End");
  await page.keyboard.type(" ");
  const kept = page.locator(".note", { hasText: "what is typed is kept here until it is back" });
  await kept.waitFor();
  await node(page, "WaitForUser").click();
  await page.getByTestId("design-tree").press("Delete");
  const refused = page.getByTestId("refused").getByText("not connected to the program");
  await refused.waitFor();
  const again = await serve_design(folder, ["--at", `127.0.0.1:${program.port}`]);
  await page.locator(".strip.lost").waitFor({ state: "detached" });
  const back = Date.now();
  await kept.waitFor({ state: "detached" });
  await refused.waitFor({ state: "detached" });
  assert.ok(Date.now() - back < 7000, "not only because nothing is said for longer");
  await close();
  await again.stop();
});

test("a new leaf without its port is marked until it has one", async () => {
  const program = await serve_design(copy_of("recharge"));
  const { page, close } = await open_design(program.url);
  await node(page, "BeAtKitchen").click();
  await settled(page);
  await page.locator('[data-palette="GoToLocation"]').dblclick();
  await page.locator('[data-name="GoToLocation"][data-errors="1"]').waitFor();
  await page.getByTestId("problems").getByText("✗ 1 error").waitFor();
  await page.locator(".design-right").getByText('input "destination" of GoToLocation has no value').waitFor();
  await page.getByLabel(/^destination/).fill("kitchen");
  await page.keyboard.press("Enter");
  await page.locator('[data-name="GoToLocation"][data-errors="0"]').waitFor();
  // Two actions under a ReactiveFallback start anew by turns, which stays a warning.
  await page.getByTestId("problems").getByText("! 1 warning").waitFor();
  await close();
  await program.stop();
});

test("a text that is broken keeps its picture, dimmed, and says why nothing can be done to it", async () => {
  const folder = copy_of("recharge");
  const program = await serve_design(folder);
  const { page, close } = await open_design(program.url);
  await node(page, "AtKitchen").click();
  await settled(page);
  await page.locator(".cm-line", { hasText: 'name="BeAtKitchen"' }).click();
  await page.keyboard.press("End");
  await page.keyboard.press("Backspace");
  await page.getByTestId("broken").waitFor();
  assert.match(await page.getByTestId("broken").innerText(), /^line 2[67]:/);
  assert.equal(await node(page, "AtKitchen").count(), 1);
  assert.match(await page.getByTestId("design-tree").getAttribute("class"), /dim/);
  await node(page, "AtKitchen").click();
  await page.keyboard.press("Delete");
  await until(async () => /mend the text first/.test(await page.getByTestId("refused").innerText()), "the gesture is refused");
  await page.keyboard.press("Control+z");
  await until(async () => (await page.getByTestId("broken").count()) === 0, "the picture is back");
  assert.equal(await node(page, "AtKitchen").getAttribute("aria-selected"), "true");
  await page.keyboard.press("Delete");
  await until(async () => (await node(page, "AtKitchen").count()) === 0, "and can be edited");
  await close();
  await program.stop();
});

test("what another editor writes is shown; where both wrote, both are kept until one is chosen", async () => {
  const folder = copy_of("recharge");
  const file = join(folder, "mission.xml");
  const program = await serve_design(folder);
  const { page, close } = await open_design(program.url);
  await node(page, "AtKitchen").waitFor();
  const began = Date.now();
  spawnSync("sed", ["-i", 's/name="AtKitchen"/name="AtTheKitchen"/', file]);
  await node(page, "AtTheKitchen").waitFor();
  console.log(`# from disk to the page: ${Date.now() - began} ms`);
  await until(async () => /^\S+ changed on disk$/.test(await undo_name(page)), "it is a step");

  // Different lines are joined.
  await select_word(page, 'name="WaitForUser"', "WaitForUser");
  await node(page, "GoToStation").click();
  await page.keyboard.press("F2");
  await page.locator("#design-name").fill("DriveToStation");
  await page.keyboard.press("Enter");
  await node(page, "DriveToStation").waitFor();
  spawnSync("sed", ["-i", 's/name="AtTheKitchen"/name="AtKitchen"/', file]);
  await node(page, "AtKitchen").waitFor();
  assert.equal(await node(page, "DriveToStation").count(), 1);

  // The same line is a conflict.
  spawnSync("sed", ["-i", 's/name="GoToStation"/name="RollToStation"/', file]);
  await page.getByTestId("conflict").waitFor();
  const shown = await page.getByTestId("conflict").innerText();
  assert.match(shown, /DriveToStation/);
  assert.match(shown, /RollToStation/);
  await page.keyboard.press("Control+s");
  await page.getByTestId("refused").getByText("not saved: mission.xml").waitFor();
  await page.getByRole("button", { name: "Keep this" }).click();
  await until(async () => (await page.getByTestId("conflict").count()) === 0, "one is chosen");
  await page.getByTestId("save").click();
  await until(() => readFileSync(file, "utf8").includes('name="DriveToStation"'), "it is saved");
  assert.ok(!readFileSync(file, "utf8").includes("RollToStation"));

  // What is no text any more is neither gone nor written over.
  const mended = readFileSync(file);
  appendFileSync(file, "<!-- caf\xe9 -->\n", "latin1");
  await page.getByTestId("conflict").getByText("it is no UTF-8").waitFor();
  assert.equal(await node(page, "DriveToStation").count(), 1);
  await page.keyboard.press("Control+z");
  await node(page, "AtTheKitchen").waitFor();
  await page.keyboard.press("Control+s");
  await page.getByTestId("refused").getByText("not saved: mission.xml").waitFor();
  assert.ok(readFileSync(file, "latin1").includes("caf\xe9"));
  await page.keyboard.press("Control+Shift+Z");
  await node(page, "AtKitchen").waitFor();
  await page.getByRole("button", { name: "Write this text over it" }).click();
  await until(async () => (await page.getByTestId("conflict").count()) === 0, "it was chosen");
  assert.deepEqual(readFileSync(file), mended);
  await close();
  await program.stop();
});

test("undo goes over all files, to identical bytes, also after the page was loaded again", async () => {
  const folder = copy_of("recharge");
  const before = contents(folder);
  const program = await serve_design(folder);
  const { page, close } = await open_design(program.url);
  await node(page, "WaitForUser").click();
  await page.keyboard.press("Control+ArrowUp");
  await until(async () => (await undo_name(page)) === "move WaitForUser within Recharge", "a leaf has moved");
  await page.locator('[data-file="skills/GoToLocation.scxml"]').click();
  await page.getByTestId("design-chart").waitFor();
  // The whole of it: at first as much is shown as can be read.
  const chart = page.getByTestId("design-chart");
  await until(async () => {
    await chart.press("0");
    const [whole, state] = [await chart.boundingBox(), await chart.locator("[data-id=moving]").boundingBox()];
    return state.y + state.height < whole.y + whole.height;
  }, "the whole chart is shown");
  await page.locator("[data-testid=design-chart] [data-id=moving]").click();
  await page.keyboard.press("F2");
  await page.locator("#design-state").fill("driving");
  await page.keyboard.press("Enter");
  await until(async () => (await undo_name(page)) === "rename moving to driving", "a state was renamed");
  await page.locator("[data-testid=design-chart] [data-id=driving]").waitFor();
  await page.locator('[data-file="world/world.yaml"]').click();
  await page.locator(".cm-line").first().click();
  await page.keyboard.type("# mine ");
  await until(async () => (await undo_name(page)) === "type in world/world.yaml", "the world was changed");
  await page.getByTestId("save").click();
  await until(async () => (await page.locator("[data-dirty=true]").count()) === 0, "all is saved");
  // Wherever it was named.
  assert.equal(contents(folder)["skills/GoToLocation.scxml"].match(/driving/g).length, before["skills/GoToLocation.scxml"].match(/"moving"/g).length);
  await page.reload();
  await page.locator(".design").waitFor();
  for (const left of ["rename moving to driving", "move WaitForUser within Recharge", ""]) {
    await page.keyboard.press("Control+z");
    await until(async () => (await undo_name(page)) === left, `undone to ${left}`);
  }
  await page.keyboard.press("Control+s");
  await until(async () => (await page.locator("[data-dirty=true]").count()) === 0, "all is saved");
  assert.deepEqual(contents(folder), before);
  await page.keyboard.press("Control+Shift+Z");
  await until(async () => (await undo_name(page)) === "move WaitForUser within Recharge", "and done again");
  await close();
  // What was not saved is there again when the program is.
  await until(() => readFileSync(join(folder, ".sentree/journal"), "utf8").includes("WaitForUser"), "the journal is written");
  await program.stop("SIGKILL");
  const again = await serve_design(folder);
  const second = await open_design(again.url);
  await until(async () => (await undo_name(second.page)) === "move WaitForUser within Recharge", "the step is known");
  await second.page.locator('[data-file="mission.xml"][data-dirty=true]').waitFor();
  await second.close();
  await again.stop();
});
