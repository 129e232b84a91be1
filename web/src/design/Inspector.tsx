import { useState } from "react";

import type { OutlineNode, OutlineTree, PaletteNode } from "../protocol/types";
import { Icon } from "../widgets/Icon";
import { add_part, findings_at, findings_of, fix, gesture, node_of, open_file, tree_of, useDesign, kNoFiles } from "./design";
import { Editable } from "./Editable";
import { Options, TextField } from "./TextField";

const kConditions = ["_skipIf", "_successIf", "_failureIf", "_while", "_onSuccess", "_onFailure", "_onHalted", "_post"];

/** The chosen node: what it is called, its ports and conditions, and what is wrong with it. */
export function Inspector() {
  const node = useDesign(node_of);
  const tree = useDesign(tree_of);
  if (!node || !tree) {
    return (
      <div className="inspector-empty muted">
        <p>Choose a node to see its ports.</p>
        <dl className="keys">
          <Key keys="Enter" what="add a sibling" />
          <Key keys="Tab" what="add a child" />
          <Key keys="Shift Tab" what="move out" />
          <Key keys="Ctrl ↑ ↓" what="move among siblings" />
          <Key keys="W / U" what="wrap in … / unwrap" />
          <Key keys="E" what="as a tree of its own / back" />
          <Key keys="D" what="a second one behind it" />
          <Key keys="Ctrl C X V" what="copy, cut, paste" />
          <Key keys="F2" what="rename" />
          <Key keys="Del" what="delete" />
          <Key keys="Alt drag" what="copy" />
        </dl>
      </div>
    );
  }
  return <NodeForm key={`${node.element}`} node={node} tree={tree} />;
}

function Key({ keys, what }: { keys: string; what: string }) {
  return (
    <div>
      <dt>
        <kbd className="kbd">{keys}</kbd>
      </dt>
      <dd>{what}</dd>
    </div>
  );
}

function NodeForm({ node, tree }: { node: OutlineNode; tree: OutlineTree }) {
  const model = useDesign((state) => state.palette.find(({ id }) => id === node.id) ?? null);
  const summary = useDesign((state) => state.summary);
  const file = useDesign((state) => state.file);
  const files = useDesign((state) => state.summary?.files ?? kNoFiles);
  const skill = files.find((candidate) => candidate.file === `skills/${node.id}.scxml`)?.file;
  const is_leaf = node.kind === "action" || node.kind === "condition";
  const written = new Map(node.attributes);
  const ports = model?.ports ?? [];
  const others = node.attributes.filter(([name]) => !ports.some((port) => port.name === name));
  const wrong = findings_at(findings_of(summary, file), node);
  return (
    <form className="inspector-form scroll" aria-label="Chosen node" onSubmit={(event) => event.preventDefault()} data-testid="inspector">
      <h2 className="inspector-title">
        <span className="ellipsis">{node.name || node.id}</span>
        <span className="badge">{node.id === (node.name || node.id) ? node.kind : node.id}</span>
      </h2>
      {model?.description && <p className="muted">{model.description}</p>}
      <Editable>
        {wrong.map((finding, i) => (
          <p key={i} className={`inspector-finding ${finding.severity}`}>
            {finding.message}
            {finding.fixes.map((which) => (
              <button key={which.title} type="button" className="button small" onClick={() => void fix(finding, which)}>
                Write “{which.title}”
              </button>
            ))}
            {finding.code === "bt.unknown-node" && (
              <button type="button" className="button small" onClick={() => void add_part("skill", node.id, false)}>
                Make the skill {node.id}
              </button>
            )}
          </p>
        ))}
        <Field id="design-name" label="name" value={node.name} node={node} attribute="name" hint={node.id} options={[]} />
        {ports.map((port) => (
          <Field
            key={port.name}
            id={`design-port-${port.name}`}
            label={port.name}
            direction={port.direction}
            type={port.type}
            value={written.get(port.name) ?? ""}
            node={node}
            attribute={port.name}
            hint={port.default ?? port.description}
            options={options_of(tree, port)}
          />
        ))}
        {others.map(([name, value]) => (
          <Field key={name} id={`design-port-${name}`} label={name} value={value} node={node} attribute={name} hint="" options={[]} />
        ))}
      </Editable>
      {is_leaf && (
        <p className="inspector-actions">
          {skill ? (
            <button type="button" className="button small" onClick={() => void open_file(skill)}>
              <Icon name="chart" />
              Open its chart
            </button>
          ) : (
            model === null && (
              <Editable>
                <button type="button" className="button small" onClick={() => void add_part("skill", node.id)}>
                  <Icon name="plus" />
                  Make its chart
                </button>
              </Editable>
            )
          )}
        </p>
      )}
      <Editable>
        <AddAttribute node={node} />
      </Editable>
    </form>
  );
}

/** What a port may sensibly be: places for texts, truth values, and entries that are there. */
function options_of(tree: OutlineTree, port: PaletteNode["ports"][number]): string[] {
  const { world_places } = useDesign.getState();
  const entries = new Set(tree.nodes.flatMap(({ attributes }) => attributes.map(([, value]) => value)).filter((value) => /^\{\w+\}$/.test(value)));
  const fixed = port.type === "bool" ? ["true", "false"] : /Status/.test(port.type) ? ["SUCCESS", "FAILURE", "RUNNING"] : port.direction !== "output" && /string/.test(port.type) ? world_places : [];
  return [...fixed, ...entries, `{${port.name}}`].filter((value, i, all) => all.indexOf(value) === i);
}

interface FieldProps {
  id: string;
  label: string;
  direction?: string;
  type?: string;
  value: string;
  node: OutlineNode;
  attribute: string;
  hint: string;
  options: readonly string[];
}

/** An empty one takes the attribute away. */
function Field({ label, direction, type, node, attribute, ...field }: FieldProps) {
  const named = (
    <>
      {direction === "output" ? "→ " : direction === "inout" ? "↔ " : ""}
      {label}
      {type && <span className="muted"> {type.replace("std::", "")}</span>}
    </>
  );
  return <TextField {...field} label={named} tell={(text) => void gesture({ what: "set", node: node.element, name: attribute, value: text === "" ? null : text })} />;
}

function AddAttribute({ node }: { node: OutlineNode }) {
  const [name, set_name] = useState("");
  const add = () => {
    if (/^[A-Za-z_][\w.:-]*$/.test(name)) void gesture({ what: "set", node: node.element, name, value: "" }).then((done) => done && set_name(""));
  };
  return (
    <div className="inspector-field add">
      <label htmlFor="design-add">add a port or condition</label>
      <input id="design-add" className="field" list="design-add-options" placeholder="_skipIf, …" spellCheck={false} value={name} onChange={(event) => set_name(event.target.value)} onKeyDown={(event) => event.key === "Enter" && add()} />
      <Options id="design-add" options={kConditions} />
    </div>
  );
}
