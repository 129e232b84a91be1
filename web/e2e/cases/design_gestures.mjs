// Whatever is done to a tree or a chart by key, only its own lines change, it stays a text as it was written, and undoing all
// of it brings back each byte. What is done is drawn from a seed: SEED, EXAMPLES and GESTURES say otherwise than here.
import assert from "node:assert/strict";
import { Buffer } from "node:buffer";
import { spawnSync } from "node:child_process";
import { writeFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";

import { operate, until } from "../harness/browser.mjs";
import { contents, copy_of, open_design, serve_design, undo_name } from "../harness/design.mjs";
import { run, scratch } from "../harness/program.mjs";

const seed = Number(process.env.SEED ?? 8);
const kExamples = (process.env.EXAMPLES ?? "recharge").split(",");
const kGestures = Number(process.env.GESTURES ?? 6);

function chance(state) {
  return (bound) => {
    state = (state * 1664525 + 1013904223) >>> 0;
    return Math.floor((state / 2 ** 32) * bound);
  };
}

const text_of = async (page, file) => (await operate(page, "design_read", { file })).text;

/** Lines that git says were added and taken away. */
function numstat(folder, before, after) {
  const [a, b] = [join(folder, "a"), join(folder, "b")];
  writeFileSync(a, before);
  writeFileSync(b, after);
  const [added, removed] = spawnSync("git", ["diff", "--no-index", "--numstat", a, b], { encoding: "utf8" }).stdout.split("\t");
  return [Number(added ?? 0), Number(removed ?? 0)];
}

const lines = (text) => text.split("\n").length;

/** By key, in trees: at the chosen node. Some ask for a kind. */
const kTreeKeys = ["Delete", "d", "u", "e", "Shift+Tab", "Control+ArrowUp", "Control+ArrowDown", "w Inverter", "Enter Fallback", "Tab AlwaysSuccess"];
/** In charts: at the chosen state. */
const kChartKeys = ["Delete", "n go"];

async function press(page, keys) {
  const [key, kind] = keys.split(" ");
  await page.keyboard.press(key);
  if (!kind) return;
  // A field asks for it, or it was refused.
  await until(() => page.evaluate(() => document.activeElement?.tagName === "INPUT" || document.querySelector("[data-testid=refused]") !== null), "a field asks");
  await page.keyboard.type(kind);
  await page.keyboard.press("Enter");
}

for (const name of kExamples) test(`random gestures in ${name} change their own lines only, and are undone to each byte (seed ${seed})`, async () => {
  const draw = chance(seed);
  const folder = copy_of(name);
  const beside = scratch();
  const original = contents(folder);
  const formatted = async (file) => (await run(["fmt", "--check", join(folder, file)])).code;
  const program = await serve_design(folder);
  const { page, close } = await open_design(program.url);
  const { files } = await operate(page, "design", {});
  const wanted = files.filter(({ kind }) => kind === "mission" || kind === "skill" || kind === "monitor" || kind === "model").map(({ file }) => file);
  const trees = wanted.filter((file) => file.endsWith(".xml"));
  const was = new Map();
  for (const file of wanted) was.set(file, await formatted(file));
  let done = 0;
  for (let i = 0; i < kGestures; i += 1) {
    const some = draw(2) === 0 ? wanted : trees;
    const file = some[draw(some.length)];
    await page.locator(`.file-row[data-file="${file}"]`).click();
    const before = await operate(page, "design_read", { file });
    if (!before.trees && !before.chart) continue;
    await page.locator(".design-picture").waitFor();
    const step = await undo_name(page);
    let part = "";
    let keys = "";
    if (before.trees) {
      const shown = before.trees.find(({ id }) => id === before.main) ?? before.trees[0];
      const node = shown.nodes[draw(shown.nodes.length)];
      if (!node) continue;
      keys = kTreeKeys[draw(kTreeKeys.length)];
      // From the root it leads out of the picture.
      if (keys === "Shift+Tab" && node.parent < 0) continue;
      part = Buffer.from(before.text).subarray(node.from, node.to).toString();
      await page.locator(`[data-testid=design-tree] [data-element="${node.element}"] > .shape`).first().dispatchEvent("pointerdown", { button: 0, pointerType: "mouse" });
      await page.locator("body").dispatchEvent("pointerup");
      await page.getByTestId("design-tree").focus();
    } else {
      const states = before.chart.states.filter(({ id }) => id !== "");
      const state = states[draw(states.length)];
      keys = kChartKeys[draw(kChartKeys.length)];
      part = before.text;
      await page.locator(`[data-testid=design-chart] [data-id="${state.id}"]`).first().dispatchEvent("click");
      await page.getByTestId("design-chart").focus();
    }
    await press(page, keys);
    // Done, or refused with the reason.
    const told = () => page.getByTestId("refused").count();
    const changed = async () => (await operate(page, "design_read", { file })).version !== before.version;
    await until(async () => (await changed()) || (await told()) > 0 || (await undo_name(page)) !== step, `${keys} is done or refused`);
    await page.keyboard.press("Escape");
    const after = await text_of(page, file);
    if (after === before.text) continue;
    done += 1;
    const [added, removed] = numstat(beside, before.text, after);
    console.log(`# ${file} ${keys}: ${await undo_name(page)} +${added} -${removed} of ${lines(part)}`);
    if (before.trees && keys !== "e") assert.ok(Math.max(added, removed) <= lines(part) + 3, `${keys} in ${file}: ${added} lines added, ${removed} taken away of ${lines(part)}\n${part}`);
  }
  assert.ok(done > 0, "something was done");
  await page.keyboard.press("Control+s");
  await until(async () => (await page.locator("[data-dirty=true]").count()) === 0, "all is saved");
  for (const [file, code] of was) assert.ok((await formatted(file)) <= code, `sentree fmt --check ${file}`);
  while ((await undo_name(page)) !== "") {
    const at = await page.getByTestId("undo").innerText();
    await page.keyboard.press("Control+z");
    await until(async () => (await page.getByTestId("undo").innerText()) !== at, "a step is undone");
  }
  await page.keyboard.press("Control+s");
  await until(async () => (await page.locator("[data-dirty=true]").count()) === 0, "all is saved");
  assert.deepEqual(contents(folder), original);
  await close();
  await program.stop();
});
