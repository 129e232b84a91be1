// Charts by mouse.
import assert from "node:assert/strict";

import { until } from "./browser.mjs";
import { drag, middle } from "./design.mjs";

/** A chart with what an edit is to keep: comments, quotes of both kinds, what an editor has written. */
export const kOwnChart = `<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript" name="Own" initial="moving">
  <!-- on the way -->
  <state id="moving" xmlns:qt="http://www.qt.io" qt:editorinfo="geometry:1;2">
    <transition event='tick' target='idle'/> <!-- stops -->
    <transition event="halt" target="halted"/>
  </state>
  <state id="idle"><transition event="go" target="moving"/></state>
  <state id="trip">
    <state id="out"/>
    <state id="back"/>
  </state>
  <final id="halted"/>
</scxml>
`;

/** Where the floor of a chart's picture is bare. */
export const floor = (page) =>
  page.getByTestId("design-chart").evaluate((svg) => {
    const box = svg.getBoundingClientRect();
    for (let y = box.top + 12; y < box.bottom - 12; y += 16) {
      for (let x = box.left + 12; x < box.right - 12; x += 16) if (document.elementFromPoint(x, y) === svg) return { x, y };
    }
    return null;
  });
/** Where a state can be held by its edge. */
export const edge_of = (page, id) =>
  page.locator(`[data-testid=design-chart] [data-id="${id}"]`).evaluate((state) => {
    const { left, right, top, bottom } = state.querySelector("rect").getBoundingClientRect();
    const middle = (top + bottom) / 2;
    const sides = [-8, -4, 0, 4, 8].flatMap((up) => [{ x: left + 2, y: middle + up }, { x: right - 2, y: middle + up }]);
    return sides.find(({ x, y }) => document.elementFromPoint(x, y)?.closest("[data-id]") === state) ?? null;
  });
export const state_at = (page, id) => page.locator(`[data-testid=design-chart] [data-id="${id}"]`);

export async function draw_state(page, id, size) {
  // A picture with one state more is fitted anew.
  const at = await until(() => floor(page), "there is a bare place");
  await page.mouse.dblclick(at.x, at.y);
  await until(() => page.evaluate(() => document.activeElement?.id === "design-state"), "the id is asked for");
  await page.keyboard.type(id);
  await page.keyboard.press("Enter");
  await state_at(page, id).waitFor();
  await until(async () => (await page.locator("[data-testid=design-chart] [data-id]").count()) === size, "it is drawn once");
}

export async function draw_transition(page, from, to, event, condition = "") {
  const begin = await until(() => edge_of(page, from), `${from} can be held by its edge`);
  const count = await page.locator("[data-testid=design-chart] [data-transition]").count();
  await drag(page, begin, await middle(state_at(page, to)));
  await page.mouse.up();
  await until(() => page.evaluate(() => document.activeElement?.id === "design-event"), "the event is asked for");
  assert.equal(await page.locator("#design-target").inputValue(), to);
  await page.keyboard.type(event);
  await page.locator("#design-condition").fill(condition);
  await page.keyboard.press("Enter");
  await until(async () => (await page.locator("[data-testid=design-chart] [data-transition]").count()) > count, `${from} leads to ${to}`);
}

/** A place on a transition's line where nothing lies over it. */
export const place_of_transition = (page, label) =>
  page.getByTestId("design-chart").evaluate((svg, wanted) => {
    const group = [...svg.querySelectorAll("[data-transition]")].find((each) => each.getAttribute("aria-label") === wanted);
    const line = group?.querySelector(".hold");
    if (!line) return null;
    const matrix = line.getScreenCTM();
    const length = line.getTotalLength();
    for (let part = 0.5; part < 0.95; part += 0.03) {
      for (const at of [part, 1 - part]) {
        const { x, y } = line.getPointAtLength(length * at).matrixTransform(matrix);
        if (document.elementFromPoint(x, y)?.closest("[data-transition]") === group) return { x, y };
      }
    }
    return null;
  }, label);

/** By its label, as "Transition moving tick → idle". */
export async function click_transition(page, label, options = {}) {
  const at = await until(() => place_of_transition(page, label), `${label} can be clicked`);
  await page.mouse.click(at.x, at.y, options);
}

/** A state is carried to a place and let go there. */
export async function carry_state(page, id, to) {
  const from = await middle(state_at(page, id).locator(".name").first());
  await drag(page, from, to);
}

export const choose_in_menu = (page, name) => page.getByRole("menu").getByRole("menuitem", { name, exact: true }).click();
