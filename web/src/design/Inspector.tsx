import { useMemo, useState } from "react";

import type { Finding, OutlineNode, OutlineTree, PaletteNode } from "../protocol/types";
import { Icon } from "../widgets/Icon";
import { add_part, chart_of, default_chart, findings_at, findings_of, fix, focus_field, gesture, node_of, nodes_of, open_file, rename_node, rename_tree, show_tree, tree_of, useDesign } from "./design";
import { Editable } from "./Editable";
import { called_of, kNodeCommands, press_tree_key, words_for } from "./Picture";
import { Options, TextField } from "./TextField";

const kConditions = ["_skipIf", "_successIf", "_failureIf", "_while", "_onSuccess", "_onFailure", "_onHalted", "_post"];

/** The chosen node: what it is called, its ports and conditions, and what is wrong with it. */
export function Inspector() {
  const node = useDesign(node_of);
  const tree = useDesign(tree_of);
  const chosen = useDesign((state) => state.chosen);
  const also = useDesign((state) => state.also);
  const nodes = useMemo(() => nodes_of({ chosen, also }, tree), [chosen, also, tree]);
  if (tree && nodes.length > 1) return <NodesForm nodes={nodes} tree={tree} />;
  if (!node || !tree) {
    return (
      <div className="inspector-empty muted scroll" tabIndex={0}>
        {tree && <TreeForm key={tree.id} tree={tree} />}
        <p>Choose a node to see its ports.</p>
        <dl className="keys">
          <Key keys="Enter" what="add a sibling" />
          <Key keys="Tab" what="add a child" />
          <Key keys="Shift Tab" what="move out" />
          <Key keys="Ctrl ↑ ↓" what="move among siblings" />
          <Key keys="W / U" what="wrap in … / unwrap" />
          <Key keys="E" what="as a tree of its own / back" />
          <Key keys="D" what="another one behind it" />
          <Key keys="S" what="disable / enable" />
          <Key keys="Shift" what="several: click, arrow, band" />
          <Key keys="Ctrl A" what="choose all" />
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

/** The tree as a whole. */
function TreeForm({ tree }: { tree: OutlineTree }) {
  const [name, set_name] = useState("");
  const is_only = useDesign((state) => (state.file === null ? 0 : (state.docs[state.file]?.shown_trees?.length ?? 0)) < 2);
  const add = () => {
    if (name.trim() !== "") void gesture({ what: "add_tree", id: name.trim() }).then((done) => done && set_name(""));
  };
  return (
    <form className="tree-form" aria-label="Tree" onSubmit={(event) => event.preventDefault()} data-testid="tree-form">
      <h2 className="inspector-title">
        <span className="ellipsis">{tree.id}</span>
        <span className="badge">tree</span>
      </h2>
      <Editable>
        <TextField id="design-tree-id" label="name, here and wherever it is named" value={tree.id} tell={(to) => to !== "" && void rename_tree(tree.id, to)} />
        {!is_only && (
          <button type="button" className="button small" onClick={() => void gesture({ what: "delete_tree", node: tree.element })}>
            Delete the tree {tree.id}
          </button>
        )}
        <div className="inspector-field add">
          <label htmlFor="design-new-tree">new tree</label>
          <input id="design-new-tree" className="field" placeholder="its name" spellCheck={false} value={name} onChange={(event) => set_name(event.target.value)} onKeyDown={(event) => event.key === "Enter" && add()} />
          <button type="button" className="button small" disabled={name.trim() === ""} onClick={add}>
            Add a tree
          </button>
        </div>
      </Editable>
    </form>
  );
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

/** Several nodes: what can be done to all of them, and the ports that all have. */
function NodesForm({ nodes, tree }: { nodes: readonly OutlineNode[]; tree: OutlineTree }) {
  const palette = useDesign((state) => state.palette);
  const [first] = nodes;
  const ports = nodes.every(({ id }) => id === first!.id) ? (palette.find(({ id }) => id === first!.id)?.ports ?? []) : [];
  const value_of = (node: OutlineNode, port: string) => node.attributes.find(([name]) => name === port)?.[1] ?? "";
  return (
    <form className="inspector-form scroll" aria-label="Chosen nodes" onSubmit={(event) => event.preventDefault()} data-testid="inspector-several">
      <h2 className="inspector-title">
        <span className="ellipsis">{nodes.length} nodes</span>
        {ports.length > 0 && <span className="badge">{first!.id}</span>}
      </h2>
      <p className="muted">{nodes.map(called_of).join(", ")}</p>
      <Editable>
        {ports.map((port) => {
          const values = new Set(nodes.map((node) => value_of(node, port.name)));
          const one = values.size === 1;
          return <Field key={port.name} id={`design-port-${port.name}`} label={port.name} direction={port.direction} type={port.type} value={one ? [...values][0]! : ""} nodes={nodes} attribute={port.name} hint={one ? (port.default ?? port.description) : `${values.size} different ones`} options={options_of(tree, port)} />;
        })}
        <p className="inspector-actions">
          {kNodeCommands
            .filter(({ alone }) => !alone)
            .map((command) => (
              <button key={command.keys} type="button" className="button small" title={command.keys} onClick={() => press_tree_key(command.key, command.held)}>
                {words_for(command, nodes)}
              </button>
            ))}
        </p>
      </Editable>
    </form>
  );
}

function NodeForm({ node, tree }: { node: OutlineNode; tree: OutlineTree }) {
  const model = useDesign((state) => state.palette.find(({ id }) => id === node.id) ?? null);
  const summary = useDesign((state) => state.summary);
  const file = useDesign((state) => state.file);
  const chart = useDesign((state) => chart_of(state, node));
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
        <Wrong findings={wrong} skill={node.id} />
        <TextField id="design-name" label="name, here and wherever it is named" value={node.name} hint={node.id} tell={(name) => void rename_node(node, name)} />
        {ports.map((port) => (
          <Field
            key={port.name}
            id={`design-port-${port.name}`}
            label={port.name}
            direction={port.direction}
            type={port.type}
            value={written.get(port.name) ?? ""}
            nodes={[node]}
            attribute={port.name}
            hint={port.default ?? port.description}
            options={options_of(tree, port)}
          />
        ))}
        {others.map(([name, value]) => (
          <Field key={name} id={`design-port-${name}`} label={name} value={value} nodes={[node]} attribute={name} hint="" options={[]} />
        ))}
      </Editable>
      {node.kind === "subtree" && (
        <p className="inspector-actions">
          <button type="button" className="button small" title="Double click on it" onClick={() => void show_tree(node.id)}>
            Open its tree
          </button>
        </p>
      )}
      {is_leaf && (
        <p className="inspector-actions">
          {chart !== null ? (
            <button type="button" className="button small" title={`${chart}: double click on the leaf`} onClick={() => void open_file(chart)}>
              <Icon name="chart" />
              <span className="ellipsis">Open its chart{chart === default_chart(node.id) ? "" : `: ${chart.replace(/^.*\//, "").replace(/\.scxml$/, "")}`}</span>
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

/** What is wrong, with its ways out; `skill`: what may be made one. */
export function Wrong({ findings, skill }: { findings: readonly Finding[]; skill?: string }) {
  return findings.map((finding, i) => (
    <p key={i} className={`inspector-finding ${finding.severity}`}>
      {finding.message}
      {finding.fixes.map((which) => (
        <button key={which.title} type="button" className="button small" onClick={() => void fix(finding, which)}>
          Write “{which.title}”
        </button>
      ))}
      {skill !== undefined && finding.code === "bt.unknown-node" && (
        <button type="button" className="button small" onClick={() => void add_part("skill", skill, false)}>
          Make the skill {skill}
        </button>
      )}
    </p>
  ));
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
  nodes: readonly OutlineNode[];
  attribute: string;
  hint: string;
  options: readonly string[];
}

/** An empty one takes the attribute away. */
function Field({ label, direction, type, nodes, attribute, ...field }: FieldProps) {
  const named = (
    <>
      {direction === "output" ? "→ " : direction === "inout" ? "↔ " : ""}
      {label}
      {type && <span className="muted"> {type.replace("std::", "")}</span>}
    </>
  );
  return <TextField {...field} label={named} tell={(text) => void gesture({ what: "set", nodes: nodes.map(({ element }) => element), name: attribute, value: text === "" ? null : text })} />;
}

function AddAttribute({ node }: { node: OutlineNode }) {
  const [name, set_name] = useState("");
  const [why_not, set_why_not] = useState("");
  const add = () => {
    if (name === "") return;
    if (!/^[A-Za-z_][\w.:-]*$/.test(name)) return set_why_not(`“${name}” is no name of a port or condition; its value is written in its own field, which comes then`);
    const written = () => {
      set_name("");
      focus_field(`design-port-${name}`);
    };
    // One that is there is not emptied.
    if (document.getElementById(`design-port-${name}`)) written();
    else void gesture({ what: "set", node: node.element, name, value: "" }).then((done) => done && written());
  };
  return (
    <div className="inspector-field add">
      <label htmlFor="design-add">add a port or condition</label>
      <input
        id="design-add"
        className="field"
        list="design-add-options"
        placeholder="_skipIf, …"
        spellCheck={false}
        value={name}
        aria-invalid={why_not !== ""}
        aria-describedby={why_not === "" ? undefined : "design-add-wrong"}
        onChange={(event) => {
          set_why_not("");
          set_name(event.target.value);
        }}
        onKeyDown={(event) => event.key === "Enter" && add()}
      />
      {why_not && (
        <p className="inspector-finding error" id="design-add-wrong" role="alert">
          {why_not}
        </p>
      )}
      <Options id="design-add" options={kConditions} />
    </div>
  );
}
