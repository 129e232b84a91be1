import { expect, it } from "vitest";

import { part_lines } from "./chart_places";

const kText = `<?xml version="1.0"?>
<scxml initial="a">
  <!-- <state id="no"> -->
  <state id="a">
    <transition event="go"
                cond="x > 1 &amp;&amp; bad"
                target="b"/>
    <onentry>
      <script>slip</script>
    </onentry>
    <transition event="stay">
      <assign location="wrong" expr="1"/>
    </transition>
  </state>
  <final id="b"/>
</scxml>
`;

it("what is wrong in a chart is of the transition or state that is drawn around it", () => {
  const chart = { states: [{ id: "a", line: 4 }, { id: "b", line: 15 }, { id: "", line: 0 }], transitions: [{ line: 5 }] };
  const places = ["wrong", "bad", "slip", 'target="b"', 'id="b"', 'initial="a"', 'id="no"'].map((part) => kText.indexOf(part));
  // A transition without a target is not drawn: it is its state's.
  expect(part_lines(chart, kText, places)).toEqual([4, 5, 4, 5, 15, 0, 0]);
  expect(part_lines(chart, "<scxml", [3])).toEqual([0]);
});
