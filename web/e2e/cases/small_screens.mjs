// At a violation the whole tree stays in sight, on every screen, and the strip is no more than a strip.
import assert from "node:assert/strict";
import { mkdirSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";

import { first_message, open_page, sticks_out, text, until } from "../harness/browser.mjs";
import { serious } from "../harness/design.mjs";
import { example, serve_run } from "../harness/program.mjs";

const kScreens = [[1920, 1080], [1440, 900], [1366, 768], [1024, 700]];
/** The stage's share of the window; the side opens over it where the window is narrow. */
const kStageMin = 0.6;
const kReadable_px = 11;
const kAll_px = 10;
const pictures = process.env.SENTREE_PICTURES;
if (pictures) mkdirSync(pictures, { recursive: true });

/** Nodes that lie in the tree's panel as a whole. */
const nodes_in_sight = (page) =>
  page.evaluate(() => {
    const frame = document.querySelector("[data-testid=tree]").getBoundingClientRect();
    const inside = ({ left, right, top, bottom }) => left >= frame.left - 1 && right <= frame.right + 1 && top >= frame.top - 1 && bottom <= frame.bottom + 1;
    return [...document.querySelectorAll("[data-testid=tree] [data-node] > .shape")].filter((shape) => inside(shape.getBoundingClientRect())).length;
  });

/** Lanes that lie in the timeline as a whole, from top to bottom. */
const lanes_in_sight = (page) =>
  page.evaluate(() => {
    const frame = document.querySelector(".timeline-scroll").getBoundingClientRect();
    const names = [...document.querySelectorAll(".lane-name")].map((lane) => ({ lane: lane.dataset.lane, box: lane.getBoundingClientRect() }));
    return names.filter(({ box }) => box.top >= frame.top - 1 && box.bottom <= frame.bottom + 1).map(({ lane }) => lane);
  });

/** Sizes on the screen of the names around the chosen node, and of all; and which names lie over one another. */
const names = (page) =>
  page.evaluate(() => {
    const size = (text) => {
      const { a, b } = text.getScreenCTM();
      return parseFloat(getComputedStyle(text).fontSize) * Math.hypot(a, b);
    };
    const texts = [...document.querySelectorAll("[data-testid=tree] [data-node] > :is(text.name, text.detail)")].filter((text) => getComputedStyle(text).display !== "none");
    const boxes = texts.map((text) => ({ said: text.textContent, node: text.parentElement, box: text.getBoundingClientRect() }));
    const over = boxes.flatMap((one, i) =>
      boxes.slice(i + 1).flatMap((other) => {
        const [a, b] = [one.box, other.box];
        const apart = a.right <= b.left || b.right <= a.left || a.bottom <= b.top + 1 || b.bottom <= a.top + 1;
        return apart || one.node === other.node ? [] : [`${one.said} / ${other.said}`];
      }),
    );
    const near = texts.filter((text) => text.matches(".near > .name")).map(size);
    return { near: Math.min(...near), all: Math.min(...texts.map(size)), over };
  });

test("at a violation the tree, the stage and the chosen text keep their size on every screen", async () => {
  const program = await serve_run(example("recharge"), { scenario: "experiment1", args: ["--clock", "virtual", "--factor", "1000"] });
  const { page, close } = await open_page(program.url, { width: kScreens[0][0], height: kScreens[0][1] });
  const wanted = (await first_message(page, "model")).tree.nodes.length;
  assert.equal(wanted, 13);
  await until(async () => (await text(page, "presence")) === "■ Ended", "the run has ended");
  await page.getByTestId("violation-moment").click();
  await page.getByTestId("past-strip").waitFor();
  // The leaf that was at work is chosen, and its monitor's chart is open.
  await page.locator("[data-testid=tree] [aria-selected=true]").waitFor();
  for (const [width, height] of kScreens) {
    await page.setViewportSize({ width, height });
    await until(async () => (await nodes_in_sight(page)) === wanted, `all nodes are in sight at ${width}×${height}`);
    const strip = await page.getByTestId("violation-banner").boundingBox();
    assert.equal(strip.height, 40);
    // One may go back to the present; then the strip of the past is gone as well.
    const stage = await page.getByTestId("stage").boundingBox();
    const past = await page.getByTestId("past-strip").boundingBox();
    const share = (stage.width * (stage.height + past.height)) / (width * height);
    assert.ok(share >= kStageMin, `the stage has ${share.toFixed(3)} of ${width}×${height}`);
    const name = await page.locator("[data-testid=tree] [aria-selected=true] text.name").first().evaluate((element) => {
      const { a, b } = element.getScreenCTM();
      return parseFloat(getComputedStyle(element).fontSize) * Math.hypot(a, b);
    });
    assert.ok(name >= kReadable_px, `the chosen name has ${name.toFixed(1)} px at ${width}×${height}`);
    // Those around it, and that they lie over none of the others.
    const { near, all, over } = await names(page);
    console.log(`# ${width}×${height}: stage ${(100 * share).toFixed(1)} %, chosen ${name.toFixed(1)} px, around it ${near.toFixed(1)} px, all at least ${all.toFixed(1)} px`);
    assert.ok(all >= kAll_px, `texts have ${all.toFixed(1)} px at ${width}×${height}`);
    assert.ok(near >= kReadable_px, `names around the chosen one have ${near.toFixed(1)} px at ${width}×${height}`);
    const states = await page.evaluate(() =>
      [...document.querySelectorAll("[data-testid=chart] text.name")].map((text) => {
        const { a, b } = text.getScreenCTM();
        return parseFloat(getComputedStyle(text).fontSize) * Math.hypot(a, b);
      }),
    );
    assert.ok(Math.min(...states) >= kReadable_px, `states of the chart have ${Math.min(...states).toFixed(1)} px at ${width}×${height}`);
    assert.deepEqual(over, [], `names lie over one another at ${width}×${height}`);
    // The mission, what is at work, and the monitors that are violated.
    const lanes = await lanes_in_sight(page);
    assert.deepEqual(lanes.slice(0, 2), ["mission", "work"], `at ${width}×${height}`);
    assert.deepEqual(lanes.slice(2, 4).sort(), ["monitor:battery", "monitor:never_empty"], `at ${width}×${height}`);
    assert.deepEqual(await serious(page), [], `axe at ${width}×${height}`);
    assert.deepEqual(await sticks_out(page), [], `at ${width}×${height}`);
    if (pictures) await page.screenshot({ path: join(pictures, `violation-${width}.png`) });
  }
  // However narrow the column is, each of its tabs can be reached from each.
  await page.setViewportSize({ width: 1366, height: 768 });
  for (const tab of ["Messages", "Reached", "Monitors", "Reached", "Messages", "Monitors"]) {
    await page.locator(".side").getByRole("tab", { name: tab }).click();
    await page.locator(`#panel-${tab.toLowerCase()}`).waitFor({ state: "visible" });
    assert.deepEqual(await serious(page), [], `axe, ${tab}`);
  }
  await page.setViewportSize({ width: 1024, height: 700 });
  await until(async () => (await nodes_in_sight(page)) === wanted, "all nodes are in sight again");
  // The story lies over the timeline and hides no node.
  await page.keyboard.press("v");
  await page.getByTestId("violation-story").waitFor();
  assert.equal(await nodes_in_sight(page), wanted);
  const story = await page.getByTestId("violation-story").boundingBox();
  const lowest = await page.evaluate(() => Math.max(...[...document.querySelectorAll("[data-testid=tree] [data-node] > .shape")].map((shape) => shape.getBoundingClientRect().bottom)));
  const chart = await page.getByTestId("violation-story").getByRole("button", { name: "Chart of never_empty" }).boundingBox();
  assert.ok(chart.y >= story.y && chart.y + chart.height <= story.y + story.height, "the way to the chart is in sight");
  assert.ok(story.y >= lowest, `the story begins at ${story.y}, the lowest node ends at ${lowest}`);
  if (pictures) await page.screenshot({ path: join(pictures, "story-1024.png") });
  await close();
  await program.stop();
});

/** Of the label that says so: its lines that do not lie in the chart's picture as a whole. */
const cut_lines = (page, said) =>
  page.getByTestId("chart").evaluate((svg, wanted) => {
    const frame = svg.getBoundingClientRect();
    const inside = ({ left, right, top, bottom }) => left >= frame.left && right <= frame.right && top >= frame.top && bottom <= frame.bottom;
    const label = [...svg.querySelectorAll(".label")].find((one) => one.textContent.replace(/\s/g, "").includes(wanted));
    return label ? [...label.querySelectorAll("text, tspan")].filter((text) => !inside(text.getBoundingClientRect())).map((text) => text.textContent) : ["there is no such label"];
  }, said);

test("what led to a violation can be read in its chart", async () => {
  const program = await serve_run(example("recharge"), { scenario: "experiment1", args: ["--clock", "virtual", "--factor", "1000"] });
  const { page, close } = await open_page(program.url, { width: kScreens[0][0], height: kScreens[0][1] });
  await until(async () => (await text(page, "presence")) === "■ Ended", "the run has ended");
  await page.getByTestId("violation-banner").getByRole("button", { name: "battery" }).click();
  await page.getByTestId("violation-moment").click();
  await page.locator("[data-testid=chart][data-chart*=battery]").waitFor();
  for (const [width, height] of kScreens) {
    await page.setViewportSize({ width, height });
    await until(async () => (await cut_lines(page, "data.result.percentage*100<20")).length === 0, `its label is whole at ${width}×${height}`);
    // A chart that has room without its values is not cut off by them.
    if (width === 1920) await until(async () => (await cut_lines(page, "getBatteryState.error")).length === 0, "all of it is there");
  }
  await close();
  await program.stop();
});

test("few buttons, and each says what it does", async () => {
  const program = await serve_run(example("recharge"), { scenario: "normal" });
  const { page, close } = await open_page(program.url);
  const buttons = await page.evaluate(() => [...document.querySelectorAll("button")].filter((button) => button.checkVisibility() && !button.closest(".lane-names")).map((button) => button.innerText.trim()));
  assert.ok(buttons.length <= 42, `${buttons.length} buttons: ${buttons.join(" | ")}`);
  assert.deepEqual(buttons.filter((said) => said === ""), [], "no button is a bare icon");
  if (pictures) await page.screenshot({ path: join(pictures, "live-1440.png") });
  await close();
  await program.stop();
});
