// The tree is edited by mouse and by keyboard; what cannot be says why.
import assert from "node:assert/strict";
import { readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";

import { until } from "../harness/browser.mjs";
import { copy_of, drag, middle, node, open_design, serve_design, settled, undo_name } from "../harness/design.mjs";
import { run, scratch } from "../harness/program.mjs";

const text_shown = (page) => page.locator(".cm-content").evaluate((element) => element.cmTile?.view?.state.doc.toString() ?? element.innerText);

test("impossible drops say why while one drags, and change nothing", async () => {
  const folder = copy_of("recharge");
  const file = join(folder, "mission.xml");
  writeFileSync(
    file,
    readFileSync(file, "utf8")
      .replace('<WaitForUser name="WaitForUser"/>', '<Inverter name="Not"><WaitForUser name="WaitForUser"/></Inverter>')
      .replace("</BehaviorTree>", '</BehaviorTree>\n  <BehaviorTree ID="Other"><AlwaysSuccess/></BehaviorTree>'),
  );
  const program = await serve_design(folder);
  const { page, close } = await open_design(program.url);
  await page.locator('[data-palette="Fallback"]').waitFor();
  const before = await text_shown(page);
  const refused = async (from, onto, why) => {
    await drag(page, await middle(from), await middle(onto));
    await until(async () => why.test(await page.getByTestId("drag-label").innerText().catch(() => "")), `it says ${why}`);
    await page.mouse.up();
    await until(async () => (await page.getByTestId("drag-label").count()) === 0, "the drag is over");
    assert.equal(await text_shown(page), before);
  };
  await refused(page.locator('[data-palette="AlwaysSuccess"]'), node(page, "Not"), /one child only/);
  await refused(page.locator('[data-palette="AlwaysSuccess"]'), node(page, "AtKitchen"), /condition: it has no children/);
  await refused(page.locator('[data-palette="Main"]'), node(page, "Recharge"), /would contain itself/);
  await refused(node(page, "Recharge"), node(page, "BeAtStation"), /into itself/);
  assert.equal(await undo_name(page), "");
  await close();
  await program.stop();
});

test("by keyboard alone a tree gets nodes, moves, wraps, renames and loses them", async () => {
  const folder = copy_of("recharge");
  const original = readFileSync(join(folder, "mission.xml"), "utf8");
  const program = await serve_design(folder);
  const { page, close } = await open_design(program.url);
  await node(page, "Root").waitFor();
  await page.locator('[data-palette="Fallback"]').waitFor();
  await page.getByTestId("design-tree").focus();
  const chosen = () => page.locator("[data-testid=design-tree] [aria-selected=true]").getAttribute("data-name");
  await page.keyboard.press("Home");
  await until(async () => (await chosen()) === "Root", "the root is chosen");
  // To its first child, whichever way the tree is drawn.
  await page.keyboard.press("ArrowRight");
  if ((await chosen()) === "Root") await page.keyboard.press("ArrowDown");
  await until(async () => (await chosen()) !== "Root", "a child is chosen");
  await node(page, "EnergyOk").click();
  await until(async () => (await chosen()) === "EnergyOk", "a node is chosen");
  // A sibling after it, by typing the beginning of its name.
  await page.keyboard.press("Enter");
  await page.getByTestId("completer").waitFor();
  await page.keyboard.type("Parall");
  await page.keyboard.press("Enter");
  await until(async () => (await chosen()) === "Parallel", "a node was added, and is chosen");
  // A child in it.
  await page.keyboard.press("Tab");
  await page.keyboard.type("AlwaysSucc");
  await page.keyboard.press("Enter");
  await until(async () => (await chosen()) === "AlwaysSuccess", "a child was added");
  await page.keyboard.press("w");
  await page.keyboard.type("Inver");
  await page.keyboard.press("Enter");
  await until(async () => (await undo_name(page)) === "wrap AlwaysSuccess in Inverter", "it was wrapped");
  await until(async () => (await chosen()) === "Inverter", "what wraps it is chosen");
  await page.getByTestId("design-tree").focus();
  await page.keyboard.press("F2");
  await page.keyboard.type("Not");
  await page.keyboard.press("Enter");
  await node(page, "Not").waitFor();
  await page.getByTestId("design-tree").focus();
  await page.keyboard.press("u");
  await until(async () => (await node(page, "Not").count()) === 0, "it was unwrapped");
  await node(page, "Parallel").click();
  await page.keyboard.press("Control+ArrowDown");
  await until(async () => /move Parallel within Root/.test(await undo_name(page)), "it moved");
  await page.keyboard.press("Delete");
  await until(async () => (await node(page, "Parallel").count()) === 0, "it is gone");
  for (;;) {
    const name = await undo_name(page);
    if (name === "") break;
    await page.keyboard.press("Control+z");
    await until(async () => (await undo_name(page)) !== name, "undone");
  }
  assert.equal(readFileSync(join(folder, "mission.xml"), "utf8"), original);
  await page.locator('[data-file="mission.xml"][data-dirty=false]').waitFor();
  await close();
  await program.stop();
});

test("a robot from nothing: a new skill in the tree, with requirement and scenario, passes check and test", async () => {
  const folder = join(scratch(), "robot");
  assert.equal((await run(["init", folder])).code, 0);
  const program = await serve_design(folder);
  const { page, close } = await open_design(program.url);
  await page.getByTestId("design-tree").waitFor();
  await page.locator('[data-palette="Fallback"]').waitFor();
  await settled(page);
  await page.getByTestId("design-tree").focus();
  await page.keyboard.press("Home");
  await page.keyboard.press("Tab");
  await page.getByTestId("completer").waitFor();
  await page.keyboard.type("Dock");
  await page.keyboard.press("Enter");
  await node(page, "Dock").waitFor();
  await settled(page);
  for (const [part, name] of [["requirement", "answers"], ["scenario", "docks"]]) {
    await page.getByRole("button", { name: `Add a ${part}` }).click();
    await page.getByRole("textbox", { name: `Name of the new ${part}` }).fill(name);
    await page.keyboard.press("Enter");
    await page.locator(`[data-file="${part}s/${name}.${part === "scenario" ? "yaml" : "req"}"][aria-current=true]`).waitFor();
  }
  await page.getByTestId("save").click();
  await until(async () => (await page.locator("[data-dirty=true]").count()) === 0, "all is saved");
  await page.getByRole("combobox", { name: "Scenario of the shadow run" }).selectOption("docks");
  await settled(page);
  await page.getByRole("button", { name: "Run", exact: true }).click();
  await page.locator('[data-testid=tree] [aria-label^="Dock"]').waitFor();
  await page.getByRole("button", { name: "Design", exact: true }).click();
  await page.locator(".design").waitFor();
  await close();
  await program.stop();
  const checked = await run(["check", folder]);
  assert.equal(checked.code, 0, checked.stdout);
  const tested = await run(["test", folder, "--scenario", "docks"]);
  assert.equal(tested.code, 0, tested.stdout + tested.stderr);
});
