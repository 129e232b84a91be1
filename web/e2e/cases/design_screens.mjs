// Design mode on small screens, and for people who use the keyboard or a screen reader.
import assert from "node:assert/strict";
import { mkdirSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";

import { sticks_out } from "../harness/browser.mjs";
import { copy_of, crossing, node, open_design, serious, serve_design, settled } from "../harness/design.mjs";

const kScreens = [[1920, 1080], [1440, 900], [1366, 768], [1024, 700]];
const pictures = process.env.SENTREE_PICTURES;
if (pictures) mkdirSync(pictures, { recursive: true });

test("the whole tree is visible and readable on every screen, and nothing serious bars the way", async () => {
  const folder = copy_of("recharge");
  const program = await serve_design(folder);
  for (const [width, height] of kScreens) {
    const { page, close } = await open_design(program.url, { width, height });
    await node(page, "BatteryLevelAbove30").click();
    await settled(page);
    if (pictures) await page.screenshot({ path: join(pictures, `design-${width}.png`) });
    const look = () => page.evaluate(() => {
      const frame = document.querySelector("[data-testid=design-tree]").getBoundingClientRect();
      const nodes = [...document.querySelectorAll("[data-testid=design-tree] [data-element]")];
      const inside = ({ left, right, top, bottom }) => left >= frame.left - 1 && right <= frame.right + 1 && top >= frame.top - 1 && bottom <= frame.bottom + 1;
      const sizes = nodes.flatMap((element) =>
        [...element.querySelectorAll("text.name, text.detail")].map((text) => {
          const { a, b } = text.getScreenCTM();
          return parseFloat(getComputedStyle(text).fontSize) * Math.hypot(a, b);
        }),
      );
      return { inside: nodes.filter((element) => inside(element.querySelector(".shape").getBoundingClientRect())).length, least: Math.min(...sizes) };
    });
    const beside = await look();
    assert.deepEqual(await crossing(page), [], `texts that cross their nodes at ${width}×${height}`);
    await page.getByRole("button", { name: "Picture", exact: true }).click();
    await page.locator(".code").waitFor({ state: "detached" });
    const alone = await look();
    assert.deepEqual(await crossing(page), [], `texts that cross their nodes, of the picture alone, at ${width}×${height}`);
    if (pictures) await page.screenshot({ path: join(pictures, `design-picture-${width}.png`) });
    console.log(`# ${width}×${height}: texts of at least ${alone.least.toFixed(1)} px, with the text ${beside.least.toFixed(1)} px`);
    assert.deepEqual([beside.inside, alone.inside], [13, 13], `at ${width}×${height}`);
    assert.ok(alone.least >= 10 && beside.least >= 10, `texts at ${width}×${height}`);
    await page.getByRole("button", { name: "Both", exact: true }).click();
    await page.locator(".code").waitFor();
    // With less room for it, too; and what is chosen is called can be read.
    await page.getByTestId("problems").click();
    await page.locator(".problems-none").waitFor();
    assert.deepEqual(await crossing(page), [], `texts that cross their nodes beside what is wrong, at ${width}×${height}`);
    const chosen_px = await page.locator("[data-testid=design-tree] .chosen > .name").first().evaluate((text) => parseFloat(getComputedStyle(text).fontSize) * Math.hypot(text.getScreenCTM().a, text.getScreenCTM().b));
    assert.ok(chosen_px >= 11, `the chosen node's name has ${chosen_px.toFixed(2)} px at ${width}×${height}`);
    if (pictures) await page.screenshot({ path: join(pictures, `design-problems-${width}.png`) });
    await page.getByTestId("problems").click();
    assert.deepEqual(await serious(page), [], `axe at ${width}×${height}`);
    // Where there is no room for it, the run over time is there for who asks.
    assert.equal(await page.locator("#panel-timeline").count(), height > 700 ? 1 : 0);
    await page.getByTestId("timeline-switch").click();
    await page.locator("#panel-timeline").waitFor({ state: height > 700 ? "detached" : "visible" });
    await close();
  }
  await program.stop();
});

/** Every view and everything that opens over one: what is clicked or pressed in turn until it is there. */
const kViews = {
  "a chart": [(page) => page.locator('[data-file="skills/GoToLocation.scxml"]').click(), (page) => page.getByTestId("chart-form").waitFor()],
  "a state": [(page) => page.locator('[data-testid=design-chart] [data-id="starting"] .name').first().click(), (page) => page.locator("#design-state").waitFor()],
  "a state's menu": [(page) => page.getByTestId("design-chart").press("m"), (page) => page.getByRole("menu").waitFor()],
  "a transition": [(page) => page.keyboard.press("Escape"), (page) => page.getByTestId("design-chart").press("t"), (page) => page.locator("#transition-event").waitFor()],
  "a chart by hand": [(page) => page.getByTestId("simulate-button").click(), (page) => page.getByTestId("simulate-now").waitFor()],
  "requirements": [(page) => page.getByTestId("simulate-button").click(), (page) => page.locator('[data-file="requirements/recharge.req"]').click(), (page) => page.getByTestId("past").waitFor()],
  "a scenario": [(page) => page.locator('[data-file="scenarios/experiment1.yaml"]').click(), (page) => page.locator("[data-entry='0']").click()],
  "the world": [(page) => page.locator('[data-file="world/world.yaml"]').click(), (page) => page.getByTestId("design-world").waitFor()],
  "sentree.yaml": [(page) => page.locator('[data-file="sentree.yaml"]').click(), (page) => page.getByTestId("project-form").waitFor()],
  "problems": [(page) => page.getByTestId("problems").click()],
  "what is never reached": [(page) => page.getByTestId("reached-button").click()],
  "a new part": [(page) => page.getByTestId("reached-button").click(), (page) => page.locator(".project-tree").getByRole("button", { name: "Add a skill" }).click()],
  "a comparison": [(page) => page.keyboard.press("Escape"), (page) => page.getByTestId("compare-button").click(), (page) => page.getByTestId("compare").waitFor()],
  "the palette of commands": [(page) => page.keyboard.press("Control+k"), (page) => page.getByRole("combobox", { name: "Find", exact: true }).waitFor()],
  "help": [(page) => page.keyboard.press("Escape"), (page) => page.locator("dialog[open]").waitFor({ state: "detached" }), (page) => page.locator("body").press("?"), (page) => page.getByRole("dialog").waitFor()],
};

/** Each view in turn, by whatever is open in it; a chosen leaf first. */
async function see_all(url, width, height) {
  const { page, close } = await open_design(url, { width, height });
  await settled(page);
  const views = { "a leaf": [() => node(page, "GoToKitchen").click(), () => page.locator("#design-port-destination").waitFor()], ...kViews };
  for (const [view, steps] of Object.entries(views)) {
    for (const step of steps) await step(page);
    for (const folded = page.locator("details:not([open]) > summary"); (await folded.count()) > 0; ) await folded.first().click();
    assert.deepEqual(await sticks_out(page), [], `${view} at ${width}×${height}`);
    if (pictures) await page.screenshot({ path: join(pictures, `design-${view.replaceAll(" ", "-")}-${width}.png`) });
  }
  await close();
}

test("nothing serious bars the way in any view, menu or dialog, and all of it can be seen on every screen", async () => {
  const program = await serve_design(copy_of("recharge"));
  const { page, close } = await open_design(program.url);
  await settled(page);
  await node(page, "EnergyOk").click();
  await page.keyboard.press("Enter");
  await page.getByTestId("completer").waitFor();
  assert.deepEqual(await serious(page), [], "the names of nodes");
  await page.keyboard.press("Escape");
  for (const [view, steps] of Object.entries(kViews)) {
    for (const step of steps) await step(page);
    assert.deepEqual(await serious(page), [], view);
  }
  await close();
  for (const [width, height] of kScreens) await see_all(program.url, width, height);
  await program.stop();
});
