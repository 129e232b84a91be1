// Two states of files are one picture, with a mark for each difference that `sentree diff` counts.
import assert from "node:assert/strict";
import { spawn, spawnSync } from "node:child_process";
import { mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";

import { browser, until } from "../harness/browser.mjs";
import { copy_of, crossing, open_design, serve_design } from "../harness/design.mjs";
import { kPatience_ms, program, run, scratch, serve } from "../harness/program.mjs";

const pictures = process.env.SENTREE_PICTURES;
if (pictures) mkdirSync(pictures, { recursive: true });

const git = (folder, ...args) => {
  const done = spawnSync("git", ["-c", "user.name=A", "-c", "user.email=a@example.org", "-c", "commit.gpgsign=false", ...args], { cwd: folder, encoding: "utf8" });
  assert.equal(done.status, 0, done.stderr);
};

const kMissionMarks = ["added", "changed", "moved", "removed"];

/** One node added, one changed, one moved, one removed. */
function change_mission(file) {
  const text = readFileSync(file, "utf8");
  const leaf = /[ \t]*<WaitForUser name="WaitForUser"\/>\r?\n/.exec(text)[0];
  writeFileSync(
    file,
    text
      .replace(leaf, "")
      .replace('threshold="30"', 'threshold="20"')
      .replace('<ReactiveSequence name="Root">\n', `<ReactiveSequence name="Root">\n${leaf}      <AlwaysSuccess name="Fresh"/>\n`)
      .replace(/[ \t]*<BatteryNotRecharging name[^>]*\/>\r?\n/, ""),
  );
}

async function open_compare(url, { width = 1440, height = 900 } = {}) {
  const context = await (await browser()).newContext({ viewport: { width, height }, reducedMotion: "reduce" });
  const page = await context.newPage();
  page.setDefaultTimeout(kPatience_ms);
  const errors = [];
  page.on("pageerror", (error) => errors.push(String(error)));
  await page.goto(url);
  await page.getByTestId("compare").waitFor();
  return {
    page,
    async close() {
      await context.close();
      assert.deepEqual(errors, []);
    },
  };
}

/** Of the marked parts, on the screen. */
const least_text = (page) =>
  page.locator("[data-testid=compare-picture]").evaluate((picture) => {
    const size = (text) => parseFloat(getComputedStyle(text).fontSize) * Math.hypot(text.getScreenCTM().a, text.getScreenCTM().b);
    return Math.min(...[...picture.querySelectorAll("[data-part]:not([data-mark='']) text")].filter((text) => getComputedStyle(text).display !== "none").map(size));
  });
const here_is_in_sight = (page) =>
  page.locator(".compare-here").evaluate((here) => {
    const [inner, outer] = [here.getBoundingClientRect(), here.closest("svg").getBoundingClientRect()];
    return inner.left >= outer.left - 1 && inner.right <= outer.right + 1 && inner.top >= outer.top - 1 && inner.bottom <= outer.bottom + 1;
  });
const signs = (page) => page.locator("[data-testid=compare-picture] [data-sign]").evaluateAll((found) => found.map((sign) => sign.dataset.sign).sort());
const compared = (page, file) => page.locator(`[data-testid=compare][data-file="${file}"]`).waitFor();
const chosen = (page) => page.locator(".compare-row[aria-current=true]").getAttribute("data-difference");

test("two trees are one picture with a mark for each difference, walked with J and K; the program ends with its page", async () => {
  const folder = scratch();
  const [before, after] = [join(folder, "before.xml"), join(folder, "after.xml")];
  writeFileSync(before, readFileSync(join(copy_of("recharge"), "mission.xml")));
  writeFileSync(after, readFileSync(before));
  change_mission(after);
  const told = JSON.parse((await run(["diff", "--json", before, after])).stdout);
  const served = await serve(["studio", "--at", "127.0.0.1:0", "--diff", before, after]);
  const { page, close } = await open_compare(served.url);
  await compared(page, "after.xml");
  await page.getByTestId("compare-picture").waitFor();
  assert.deepEqual(await signs(page), kMissionMarks);
  assert.equal(Number(await page.getByTestId("compare").getAttribute("data-differences")), told.differences.length);
  assert.deepEqual((await page.locator("[data-difference]").evaluateAll((rows) => rows.map((row) => row.dataset.difference))), told.differences.map(({ kind }) => kind));
  assert.match(await page.getByTestId("compare-picture").textContent(), /threshold: 30 → 20/);
  assert.equal(await page.locator(".compare-move").count(), 1);
  // What differs can be read on each screen, also where one looks at the next.
  for (const [width, height] of [[1440, 900], [1366, 768], [1024, 700]]) {
    await page.setViewportSize({ width, height });
    for (let i = 0; i < told.differences.length; i += 1) {
      await until(async () => (await least_text(page)) >= 11, `the text of what differs has 11 px at ${width}×${height}`);
      await until(() => here_is_in_sight(page), `what is chosen is in sight at ${width}×${height}`);
      assert.deepEqual(await crossing(page, "compare-picture"), [], `texts that cross their nodes at ${width}×${height}`);
      // The line through what is removed has no border that lies over it.
      const borders = await page.locator("[data-testid=compare-picture] .node.removed > text").evaluateAll((texts) => texts.map((text) => getComputedStyle(text).stroke));
      assert.deepEqual([...new Set(borders)], ["none"]);
      await page.keyboard.press("j");
    }
  }
  await page.setViewportSize({ width: 1440, height: 900 });
  if (pictures) await page.screenshot({ path: join(pictures, "compare-tree.png") });
  const seen = [];
  for (let i = 0; i < told.differences.length; i += 1) {
    seen.push(await chosen(page));
    await page.locator(".compare-here").waitFor();
    await page.keyboard.press("j");
    await until(async () => (await page.locator(".compare-row").nth((i + 1) % told.differences.length).getAttribute("aria-current")) === "true", "the next is chosen");
  }
  assert.deepEqual([...seen].sort(), kMissionMarks);
  await page.keyboard.press("k");
  await until(async () => (await page.locator(".compare-row").last().getAttribute("aria-current")) === "true", "the one before is chosen");
  await page.getByRole("button", { name: "Text", exact: true }).click();
  await page.locator(".compare-text .removed", { hasText: 'threshold="30"' }).waitFor();
  await page.locator(".compare-text .added", { hasText: 'threshold="20"' }).waitFor();
  await close();
  assert.equal(await served.ended, 0);
});

test("two charts are one picture: states and transitions that came, went, changed and lead elsewhere", async () => {
  const folder = scratch();
  const chart = (states) => `<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" name="Door" initial="closed">\n${states}\n</scxml>\n`;
  const [before, after] = [join(folder, "before.scxml"), join(folder, "after.scxml")];
  writeFileSync(before, chart('<state id="closed"><transition event="open" target="moving"/><transition event="lock" target="locked"/></state>\n<state id="moving"><transition event="done" target="closed"/></state>\n<state id="locked"/><state id="outer"/>'));
  writeFileSync(after, chart('<state id="closed"><transition event="open" cond="true" target="moving"/></state>\n<state id="outer" initial="moving"><state id="moving"><transition event="done" target="ajar"/></state></state>\n<state id="ajar"/>'));
  const told = JSON.parse((await run(["diff", "--json", before, after])).stdout);
  const served = await serve(["studio", "--at", "127.0.0.1:0", "--diff", before, after]);
  const { page, close } = await open_compare(served.url);
  await compared(page, "after.scxml");
  await page.getByTestId("compare-picture").waitFor();
  assert.equal(await page.locator("[data-difference]").count(), told.differences.length);
  const marks = await page.locator("[data-testid=compare-picture] [data-part]").evaluateAll((parts) => parts.filter(({ dataset }) => dataset.mark !== "" && dataset.name).map(({ dataset }) => `${dataset.mark} ${dataset.name}`));
  assert.deepEqual(marks.filter((mark) => !/initial/.test(mark)).sort(), ["added ajar", "changed outer", "left moving", "moved moving", "removed locked"]);
  for (const kind of ["changed", "removed"]) assert.ok((await page.locator(`.compare-edge.${kind}`).count()) > 0, `a transition is ${kind}`);
  if (pictures) await page.screenshot({ path: join(pictures, "compare-chart.png") });
  await close();
  assert.equal(await served.ended, 0);
});

test("a project that is edited is compared with its last commit, what is saved, and what a recording ran", async () => {
  const folder = copy_of("recharge");
  git(folder, "init", "-q");
  git(folder, "add", ".");
  git(folder, "commit", "-q", "-m", "first");
  const recorded = await run(["run", folder, "--scenario", "recharge", "--duration", "2 s", "--record", join(folder, "runs", "first.mcap")]);
  assert.ok(recorded.code === 0 || recorded.code === 1 || recorded.code === 124, recorded.stderr);
  change_mission(join(folder, "mission.xml"));
  const told = JSON.parse((await run(["diff", "--json", join(copy_of("recharge"), "mission.xml"), join(folder, "mission.xml")])).stdout);
  const served = await serve_design(folder);
  const { page, close } = await open_design(served.url);
  await page.getByTestId("compare-button").click();
  await compared(page, "mission.xml");
  await page.getByTestId("compare-picture").waitFor();
  assert.deepEqual(await signs(page), kMissionMarks);
  assert.equal(await page.locator("[data-difference]").count(), told.differences.length);
  if (pictures) await page.screenshot({ path: join(pictures, "compare-design.png") });
  const side = page.getByRole("combobox", { name: "Compare with" });
  await side.selectOption("runs/first.mcap");
  await until(async () => (await page.getByTestId("compare").getAttribute("data-file")) === "mission.xml", "the recording's project is compared");
  await page.getByTestId("compare-picture").waitFor();
  assert.deepEqual(await signs(page), kMissionMarks);
  await side.selectOption("saved");
  await page.getByTestId("compare-same").waitFor();
  // What another program writes is compared at once.
  await side.selectOption("HEAD");
  await page.getByTestId("compare-picture").waitFor();
  writeFileSync(join(folder, "mission.xml"), readFileSync(join(folder, "mission.xml"), "utf8").replace('threshold="20"', 'threshold="30"'));
  await until(async () => (await page.locator("[data-difference]").count()) === told.differences.length - 1, "one difference less");
  await page.keyboard.press("Escape");
  await page.getByTestId("design-tree").waitFor();
  await close();
  await served.stop();
});

test("git difftool shows each file that changed, one after the other", async () => {
  const folder = copy_of("recharge");
  git(folder, "init", "-q");
  git(folder, "add", ".");
  git(folder, "commit", "-q", "-m", "first");
  change_mission(join(folder, "mission.xml"));
  const chart = join(folder, "skills", "GoToLocation.scxml");
  writeFileSync(chart, readFileSync(chart, "utf8").replace("</scxml>", '  <final id="elsewhere"/>\n</scxml>'));
  const tool = spawn("git", ["difftool", "--no-prompt", `--extcmd='${program}' studio --at 127.0.0.1:0 --diff`, "HEAD"], { cwd: folder, stdio: ["ignore", "pipe", "pipe"] });
  let output = "";
  tool.stdout.on("data", (data) => (output += data));
  tool.stderr.on("data", (data) => (output += data));
  const ended = new Promise((settle) => tool.on("close", settle));
  for (const [nth, file, marks] of [[1, "mission.xml", kMissionMarks], [2, "GoToLocation.scxml", ["added"]]]) {
    await until(() => [...output.matchAll(/the page: (http\S+)/g)].length >= nth, `page ${nth} is there: ${output}`);
    const { page, close } = await open_compare([...output.matchAll(/the page: (http\S+)/g)][nth - 1][1]);
    await until(async () => ((await page.getByTestId("compare").getAttribute("data-file")) ?? "").endsWith(file), `${file} is compared`);
    await page.getByTestId("compare-picture").waitFor();
    assert.deepEqual(await signs(page), marks);
    await close();
  }
  assert.equal(await ended, 0, output);
});
