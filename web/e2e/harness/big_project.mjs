import { cpSync, mkdirSync, writeFileSync } from "node:fs";
import { join } from "node:path";

import { example } from "./program.mjs";

/** States of each chart; every tick goes on to the next. */
const kStates = 6;

function chart(id) {
  const states = Array.from({ length: kStates }, (_, i) => {
    const next = `s${(i + 1) % kStates}`;
    return `    <state id="s${i}">\n      <transition event="tick" target="${next}"><assign location="steps" expr="steps + 1"/></transition>\n    </state>`;
  });
  return `<?xml version="1.0" encoding="UTF-8"?>
<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript" name="${id}" initial="work">
  <datamodel><data id="steps" expr="0"/></datamodel>
  <state id="work" initial="s0">
    <transition event="halt" target="halted"/>
${states.join("\n")}
  </state>
  <final id="halted"/>
</scxml>
`;
}

/**
 * A project for measuring: a tree of `nodes` nodes in which every tick changes hundreds of statuses, one chart per skill
 * that changes state with every tick, and the house of examples/recharge with a robot on its way.
 */
export function write_big_project(folder, { nodes = 300, skills = 20, rate = 50 } = {}) {
  mkdirSync(join(folder, "skills"), { recursive: true });
  cpSync(join(example("recharge"), "world"), join(folder, "world"), { recursive: true });
  cpSync(join(example("recharge"), "skills"), join(folder, "skills"), { recursive: true });
  const ids = Array.from({ length: skills - 1 }, (_, i) => `Work${i + 1}`);
  for (const id of ids) writeFileSync(join(folder, "skills", `${id}.scxml`), chart(id));
  const leaves = [`<GoToLocation name="GoToKitchen" destination="kitchen"/>`, ...ids.map((id) => `<${id} name="${id}"/>`)];
  // The root, and per skill a reactive sequence and its leaf; the rest are nodes that change with every tick.
  let left = nodes - 1 - 2 * skills;
  const branches = leaves.map((leaf, i) => {
    let share = Math.floor(left / (skills - i));
    left -= share;
    const inner = [];
    for (let n = 1; share >= 3; n++, share -= 3) inner.push(`<ForceSuccess name="f${i}_${n}"><Inverter><AlwaysFailure/></Inverter></ForceSuccess>`);
    for (; share > 0; share--) inner.push("<AlwaysSuccess/>");
    return `      <ReactiveSequence name="Branch${i + 1}">\n        ${inner.join("\n        ")}\n        ${leaf}\n      </ReactiveSequence>`;
  });
  writeFileSync(
    join(folder, "mission.xml"),
    `<?xml version="1.0" encoding="UTF-8"?>
<root BTCPP_format="4" main_tree_to_execute="Main">
  <BehaviorTree ID="Main">
    <ParallelAll name="All" max_failures="${skills}">
${branches.join("\n")}
    </ParallelAll>
  </BehaviorTree>
  <TreeNodesModel>
    <Action ID="GoToLocation"><input_port name="destination" type="std::string"/><output_port name="reason" type="std::string"/></Action>
    ${ids.map((id) => `<Action ID="${id}"/>`).join("\n    ")}
  </TreeNodesModel>
</root>
`,
  );
  writeFileSync(
    join(folder, "sentree.yaml"),
    `mission: {file: mission.xml, tree: Main, rate: ${rate} Hz}
world: world/world.yaml
services:
  battery:    {interface: robot.thrift/Battery,    at: sim}
  navigation: {interface: robot.thrift/Navigation, at: sim}
`,
  );
  return folder;
}
