// Charts of a run fold their composite states, and have a map in their corner, as those that are designed.
import assert from "node:assert/strict";
import { test } from "node:test";

import { open_page, operate, until } from "../harness/browser.mjs";
import { example, serve_run } from "../harness/program.mjs";

test("charts that were closed come back with what is chosen, and not with the leaf at work", async () => {
  const program = await serve_run(example("recharge"), { scenario: "normal" });
  const { page, close } = await open_page(program.url);
  await operate(page, "pause");
  const put_away = async () => {
    await page.locator("#panel-charts").getByRole("button", { name: "Close", exact: true }).click();
    await page.locator("#panel-charts").waitFor({ state: "detached" });
  };
  const shown = async (chart) => {
    await page.locator(`[data-testid="chart"][data-chart="${chart}"]`).waitFor();
    // What follows the leaf at work would come an instant later.
    await page.evaluate(() => new Promise((next) => requestAnimationFrame(() => requestAnimationFrame(next))));
    assert.equal(await page.getByTestId("chart-pick").inputValue(), chart);
  };
  await put_away();
  await page.getByRole("button", { name: "Chart of turns_to_station" }).click();
  await shown("monitor:turns_to_station");
  await put_away();
  await page.locator('[data-testid="tree"] [data-node]', { hasText: "WaitForUser" }).first().click();
  await shown("skill:WaitForUser");
  await put_away();
  await page.locator('[data-monitor="battery"]').click();
  await shown("monitor:battery");
  // A node without a chart leaves them away.
  await put_away();
  await page.locator('[data-testid="tree"] [data-node="0"]').click();
  await page.locator('[data-testid="tree"] [data-node="0"][aria-selected="true"]').waitFor();
  assert.equal(await page.locator("#panel-charts").count(), 0);
  await close();
  await program.stop();
});

test("a composite state is closed and opened, and says how many it hides; what is active in it stays lit", async () => {
  const program = await serve_run(example("recharge"), { scenario: "normal" });
  const { page, close } = await open_page(program.url);
  await operate(page, "pause");
  await page.getByTestId("chart-pick").selectOption("skill:GoToKitchen");
  const chart = page.locator('[data-testid="chart"][data-chart="skill:GoToKitchen"]');
  const states = () => chart.locator("[data-state]").count();
  await chart.locator('[data-id="starting"]').waitFor();
  await chart.focus();
  await page.keyboard.press("0");
  const whole = await states();
  const dots = await chart.locator(".dot").count();
  const active = await chart.locator('[data-active="true"]').count();
  await chart.locator('[data-fold="going"]').click();
  await until(async () => (await chart.locator('[data-id="starting"]').count()) === 0, "what is in it is hidden");
  const hidden = /\+(\d+)/.exec(await chart.locator(".fold-count").textContent())[1];
  // Dots are hidden too, and do not count.
  assert.equal(Number(hidden), whole - (await states()) - (dots - (await chart.locator(".dot").count())));
  assert.match(await chart.locator('[data-id="going"]').getAttribute("aria-label"), new RegExp(`${hidden} states hidden in it`));
  assert.ok((await chart.locator('[data-active="true"]').count()) >= Math.min(active, 1));

  // Another chart and back: it stays closed. Its menu opens it.
  await page.getByTestId("chart-pick").selectOption("monitor:battery");
  await page.getByTestId("chart-pick").selectOption("skill:GoToKitchen");
  await until(async () => (await chart.locator(".fold-count").count()) === 1, "it is still closed");
  await chart.locator('[data-id="going"]').click({ button: "right" });
  await page.getByRole("menuitem", { name: "Show what is in it" }).click();
  await until(async () => (await states()) === whole, "all is shown");

  // By keyboard only: the panel's menu.
  await page.locator('[data-view-of="charts"]').press("Enter");
  await page.getByRole("menuitem", { name: "Close states that hold others" }).press("Enter");
  await until(async () => (await states()) < whole, "it is closed");
  await page.locator('[data-view-of="charts"]').press("Enter");
  await page.getByRole("menuitem", { name: "Open all states" }).press("Enter");
  await until(async () => (await states()) === whole, "it is open");

  // What does not fit has a map.
  await chart.focus();
  await page.keyboard.press("0");
  await until(async () => (await page.locator(".charts-body").getByTestId("minimap").count()) === 0, "all of it is shown");
  for (let i = 0; i < 6; i += 1) await page.keyboard.press("+");
  const map = page.locator(".charts-body").getByTestId("minimap");
  await map.waitFor();
  const moved = () => chart.locator("> g").getAttribute("transform");
  const before = await moved();
  await map.click({ position: { x: 4, y: 4 } });
  await until(async () => (await moved()) !== before, "a click in the map goes there");
  await close();
  await program.stop();
});
