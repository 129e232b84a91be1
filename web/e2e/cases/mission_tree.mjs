// The tree and the charts: folding, finding, jumping, following.
import assert from "node:assert/strict";
import { test } from "node:test";

import { first_message, open_page, text, until } from "../harness/browser.mjs";
import { write_big_project } from "../harness/big_project.mjs";
import { example, scratch, serve_run } from "../harness/program.mjs";

const shown = (page) => page.locator("[data-testid=tree] [data-node]").count();

test("the tree folds, finds and leads to what is at work", async () => {
  const program = await serve_run(example("recharge"), { scenario: "normal" });
  const { page, close } = await open_page(program.url);
  const nodes = (await first_message(page, "model")).tree.nodes;
  const id = (name) => nodes.find((node) => node.name === name).id;
  await page.locator(`#node-${id("Root")}`).waitFor();
  assert.equal(await shown(page), nodes.length);

  // By keyboard: to the first child, and fold it.
  await page.getByTestId("tree").focus();
  await page.keyboard.press("Home");
  await page.keyboard.press("ArrowDown");
  await page.keyboard.press("ArrowLeft");
  const first = page.locator(`#node-${id("EnergyOk")}`);
  assert.equal(await first.getAttribute("aria-selected"), "true");
  await page.keyboard.press("Enter");
  await until(async () => (await shown(page)) < nodes.length, "its children are hidden");
  assert.equal(await first.getAttribute("aria-expanded"), "false");
  assert.equal(await page.locator(`#node-${id("GoToStation")}`).count(), 0);

  // Finding a hidden node unfolds what hides it.
  await page.keyboard.press("Control+f");
  await page.keyboard.type("destination=station");
  await page.keyboard.press("Enter");
  await page.locator(`#node-${id("GoToStation")}[aria-selected=true]`).waitFor();
  await page.keyboard.press("Escape");

  // The list of what is at work leads there; a double click opens the skill's chart.
  await page.locator(".at-work .chip", { hasText: "GoToKitchen" }).click();
  const leaf = page.locator(`#node-${id("GoToKitchen")}`);
  assert.equal(await leaf.getAttribute("aria-selected"), "true");
  assert.equal(await leaf.getAttribute("data-status"), "RUNNING");
  await page.getByTestId("chart-pick").selectOption("monitor:battery");
  await leaf.dblclick();
  const chart = page.locator('[data-testid=chart][data-chart="skill:GoToKitchen"]');
  await chart.locator("[data-id=moving][data-active=true]").waitFor();
  await chart.locator("[data-id=going][data-active=true]").waitFor();
  assert.match(await page.locator(".chart-side").innerText(), /destination\s*kitchen/);

  await page.keyboard.press("p");
  assert.match(await page.getByRole("complementary", { name: "The chosen node" }).innerText(), /destination[\s\S]*kitchen/);
  await close();
  await program.stop();
});

test("all charts stand side by side, and each shows its active state", async () => {
  const program = await serve_run(example("recharge"), { scenario: "experiment1" });
  const { page, close } = await open_page(program.url);
  const charts = (await first_message(page, "model")).charts;
  await page.keyboard.press("g");
  await until(async () => (await page.locator(".tile").count()) === charts.length, "a tile for each chart");
  await page.locator('.tile[data-chart="skill:GoToKitchen"] [data-id=moving][data-active=true]').waitFor();
  await page.keyboard.press("g");
  await page.getByTestId("chart").waitFor();
  await page.keyboard.press("c");
  assert.equal((await text(page, "presence")).length > 0, true);
  await close();
  await program.stop();
});

test("of a tree that is too large a part is shown, and what is found comes into it", async () => {
  const program = await serve_run(write_big_project(scratch(), { nodes: 350, skills: 60, rate: 10 }));
  const { page, close } = await open_page(program.url);
  const name = (node) => page.locator("[data-testid=tree] [data-node]", { hasText: node }).last().locator("text.name").first();
  const size = (of) =>
    of.evaluate((element) => {
      const { a, b } = element.getScreenCTM();
      return parseFloat(getComputedStyle(element).fontSize) * Math.hypot(a, b);
    });
  const in_sight = async (of) => {
    const [frame, box] = [await page.getByTestId("tree").boundingBox(), await of.boundingBox()];
    return box.x >= frame.x && box.y >= frame.y && box.x + box.width <= frame.x + frame.width && box.y + box.height <= frame.y + frame.height;
  };
  await name("All").waitFor();
  await until(() => in_sight(name("All")), "it begins at its root");
  assert.ok((await size(name("All"))) >= 11);
  assert.equal(await in_sight(name("Work50")), false);
  await page.keyboard.press("Control+f");
  await page.keyboard.type("Work50");
  await page.keyboard.press("Enter");
  await until(() => in_sight(name("Work50")), "it comes into sight");
  assert.ok((await size(name("Work50"))) >= 11);
  // All of it is there for who asks, and the next hit can be read all the same.
  await page.getByTestId("tree").focus();
  await page.keyboard.press("0");
  await until(async () => (await size(name("AlwaysSuccess"))) < 5, "all of it is shown");
  await page.locator("#mission-search").fill("Work7");
  await page.locator("#mission-search").press("Enter");
  await until(() => in_sight(name("Work7")), "it comes into sight");
  assert.ok((await size(name("Work7"))) >= 11);
  await close();
  await program.stop();
});
