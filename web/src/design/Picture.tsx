import { memo, useEffect, useImperativeHandle, useLayoutEffect, useMemo, useRef, useState, type Ref } from "react";
import { create } from "zustand";

import { corner, Links, Outline, Texts } from "../panels/mission/TreePicture";
import { neighbour, type Arrow } from "../panels/mission/tree";
import { is_never, node_key, useReached } from "../panels/reached/reached";
import { InView, is_near, set_lens } from "../picture/lens";
import { follow_pointer } from "../picture/drag";
import { Minimap } from "../picture/Minimap";
import { usePictureView } from "../picture/use_picture_view";
import { to_picture } from "../picture/viewport";
import { useCommand } from "../widgets/commands";
import { Menu } from "../widgets/Menu";
import { LastSign, StatusSign } from "../panels/mission/StatusSign";
import { last_shown, last_word } from "../protocol/statuses";
import { kStatuses, type Finding, type Gesture, type OutlineNode, type OutlineTree, type Rect } from "../protocol/types";
import { clipboard_text, is_xml, nothing_pasted, pasted, to_clipboard, usePaste, written_at } from "./clipboard";
import { broken, choose, choose_nodes, doc_of, findings_at, findings_of, focus_field, gesture, node_now, nodes_of, obstacle, open_node, refusal, toggle_chosen, tree_of, useDesign, version_now } from "./design";
import { nodes_inside, outermost, span_of } from "./selection";
import { kAnswers, play_tree, useSimulation } from "./simulate";
import { is_same_drawn, is_same_node } from "./same";
import { near, slot_words, type SlotPlace } from "./slots";
import { statuses_of, useRunStatuses } from "./run_statuses";
import { name_of_tree } from "./tree_names";
import { in_turn } from "./turns";

/** What is dragged: nodes of the tree, or one that is to be made. */
export type Dragged = { nodes: readonly OutlineNode[] } | { id: string; subtree: boolean; name?: string };

export interface PictureHandle {
  /** Follows the pointer with something new, until it is dropped. */
  drag(what: Dragged, event: { clientX: number; clientY: number }): void;
  /** Below the chosen node as its last child, or after it where it takes none. */
  add(id: string, subtree: boolean): void;
  fit(): void;
  focus(): void;
}

/** Asks for a node's kind, and does something with it. */
export type Ask = (what: { title: string; x: number; y: number; leaves: boolean; pick(id: string, subtree: boolean): void }) => void;

/** As if pressed in the picture of the tree. */
export function press_tree_key(key: string, held: { shiftKey?: boolean; ctrlKey?: boolean } = {}): void {
  const svg = document.querySelector<SVGSVGElement>("svg.design-picture");
  svg?.focus();
  svg?.dispatchEvent(new KeyboardEvent("keydown", { key, bubbles: true, cancelable: true, ...held }));
}

interface Drag {
  what: Dragged;
  x: number;
  y: number;
  slot: SlotPlace | null;
  why_not: string | null;
  copy: boolean;
}

const kDragFrom_px = 5;
/** Below a leaf, for what it may answer in a simulation. */
const kAnswers_px = 26;

/** What was copied or cut, to be pasted. */
interface Kept {
  nodes: readonly OutlineNode[];
  file: string;
  cut: boolean;
  /** As others are given it. */
  text: string;
  /** What was cut has been pasted. */
  spent?: boolean;
}
const useKept = create<{ kept: Kept | null }>()(() => ({ kept: null }));
/** For other files, and other editors, too. */
function keep(nodes: readonly OutlineNode[], cut: boolean): void {
  const doc = doc_of(useDesign.getState());
  if (!doc) return;
  const text = nodes.map((node) => written_at(doc, node)).join("\n");
  useKept.setState({ kept: { nodes, file: doc.file, cut, text } });
  to_clipboard(text);
}
export const called_of = (node: OutlineNode) => node.name || node.id;
const named = (nodes: readonly OutlineNode[]) => (nodes.length === 1 ? called_of(nodes[0]!) : `${nodes.length} nodes`);
const elements_of = (nodes: readonly OutlineNode[]) => nodes.map(({ element }) => element);
/** Where they are now; null: not all of them are there any more. */
function all_now(nodes: readonly OutlineNode[]): OutlineNode[] | null {
  const now = nodes.flatMap((node) => node_now(node) ?? []);
  return now.length === nodes.length ? now : null;
}
const is_disabled = ({ attributes }: OutlineNode) => attributes.some(([name, value]) => name === "_skipIf" && value === "true");

export function gesture_for(what: Dragged, slot: { parent: number; index: number }, copy: boolean): Gesture {
  if ("nodes" in what) return { what: "move", nodes: elements_of(what.nodes), parent: slot.parent, index: slot.index, ...(copy ? { copy } : {}) };
  return { what: "insert", id: what.id, ...(what.subtree ? { subtree: true } : {}), ...(what.name ? { name: what.name } : {}), parent: slot.parent, index: slot.index };
}

/** The tree as its text has it, with every gesture on it. */
export function Picture({ tree, handle, ask }: { tree: OutlineTree; handle: Ref<PictureHandle>; ask: Ask }) {
  const chosen = useDesign((state) => state.chosen?.element ?? null);
  const also = useDesign((state) => state.also);
  const beside = useMemo(() => new Set(also.map(({ element }) => element)), [also]);
  const why_dim = useDesign(broken);
  const why_not = useDesign(obstacle);
  const summary = useDesign((state) => state.summary);
  const file = useDesign((state) => state.file);
  const [drag, set_drag] = useState<Drag | null>(null);
  const [menu, set_menu] = useState<{ x: number; y: number } | null>(null);
  const [band, set_band] = useState<Rect | null>(null);
  const in_band = useMemo(() => new Set(band ? nodes_inside(tree, band) : []), [band, tree]);
  const findings = useMemo(() => findings_of(summary, file), [summary, file]);

  // What each node said in the last tick of a simulation.
  const played = useSimulation(({ on, tree: id, tree_now }) => (on && id === tree.id ? tree_now : null));
  const said = useMemo(() => new Map((played?.nodes ?? []).map(({ at, status }) => [at, status.toLowerCase()] as const)), [played]);
  const statuses = useRunStatuses(tree);
  const run_status = (node: OutlineNode) => (played ? 0 : (statuses.get(node.element) ?? 0));
  const never = useNever(tree);
  const kept = useKept((state) => state.kept);
  const cut = new Set(kept?.cut && kept.file === file ? all_now(kept.nodes) : []);
  const dragged = drag && "nodes" in drag.what && !drag.copy ? new Set(elements_of(drag.what.nodes)) : null;
  const levels = useMemo(() => {
    const found: number[] = [];
    for (const { parent } of tree.nodes) found.push(parent < 0 ? 1 : found[parent]! + 1);
    return found;
  }, [tree]);
  const latest = useRef({ tree, drag });
  latest.current = { tree, drag };
  const rects = useMemo(() => new Map(tree.nodes.map(({ element }, i) => [element, tree.layout.nodes[i]!] as const)), [tree]);
  const is_played = played !== null;
  const box: Rect = useMemo(() => ({ x: 0, y: 0, width: Math.max(tree.layout.size.width, 60), height: Math.max(tree.layout.size.height, 60) + (is_played ? kAnswers_px : 0) }), [tree, is_played]);

  const [in_view] = useState(() => new InView());
  const rect_of = (node: SVGGElement) => rects.get(Number(node.dataset["element"]));
  const { svg, group, view } = usePictureView({
    box,
    limits: { min: 0.05, max: 4 },
    margin: 10,
    fit_max: 1.15,
    readable: { from: 0.5, scale: 0.85 },
    focus: () => rects.get(chosen ?? -1) ?? tree.layout.nodes[0] ?? null,
    change: (now, size, moved) => {
      set_lens(moved, now.scale);
      in_view.follow(moved, now, size, rect_of);
    },
    grab: (event) => {
      const found = event.target instanceof Element ? event.target.closest("[data-element]") : null;
      banded.current = false;
      if (!found) return adds(event) && draw_band(event);
      press(Number(found.getAttribute("data-element")), event);
      return true;
    },
  });

  useLayoutEffect(() => set_lens(group.current, view.view.scale), [group, view, chosen, tree]);
  useLayoutEffect(() => in_view.follow(group.current, view.view, view.size, (node) => rects.get(Number(node.dataset["element"])), true), [in_view, group, view, rects]);

  const found_at = chosen === null ? -1 : tree.nodes.findIndex(({ element }) => element === chosen);
  const chosen_at = found_at < 0 ? null : found_at;
  const chosen_parent = tree.nodes[found_at]?.parent ?? null;
  // What is chosen in the text, or made by a gesture, comes into view.
  const rect = chosen === null ? undefined : rects.get(chosen);
  useEffect(() => {
    if (rect) view.reveal(rect);
  }, [rect, view]);

  // So does the leaf at work in a simulation, with its answers.
  useEffect(() => {
    const at_work = played?.nodes.findLast(({ status, leaf }) => status === "RUNNING" && leaf !== null);
    const node = at_work && tree.nodes.find(({ from }) => from === at_work.at);
    const drawn = node && rects.get(node.element);
    if (drawn) view.reveal({ ...drawn, height: drawn.height + kAnswers_px });
  }, [played, tree, rects, view]);

  /** The end of a band is no click on the floor. */
  const banded = useRef(false);
  const chosen_now = () => nodes_of(useDesign.getState(), latest.current.tree);
  const at_picture = (event: { clientX: number; clientY: number }) => {
    const at = svg.current!.getBoundingClientRect();
    return to_picture(view.view, [event.clientX - at.left, event.clientY - at.top]);
  };
  const follow = useRef<((what: Dragged, event: { clientX: number; clientY: number; altKey?: boolean }) => void) | null>(null);
  const slot_under = (event: { clientX: number; clientY: number }): SlotPlace | null => {
    const at = svg.current?.getBoundingClientRect();
    if (!at || event.clientX < at.left || event.clientX > at.right || event.clientY < at.top || event.clientY > at.bottom) return null;
    return near(latest.current.tree, at_picture(event));
  };
  follow.current = (what, event) => {
    const { drag: before } = latest.current;
    const slot = slot_under(event);
    const copy = event.altKey ?? false;
    const same = before?.slot?.parent === slot?.parent && before?.slot?.index === slot?.index && before?.copy === copy;
    set_drag({ what, x: event.clientX, y: event.clientY, slot, copy, why_not: same ? (before?.why_not ?? null) : null });
    if (!slot || same) return;
    void refusal(gesture_for(what, slot, copy)).then((why_not) => {
      set_drag((drag) => (drag && drag.slot?.parent === slot.parent && drag.slot.index === slot.index ? { ...drag, why_not } : drag));
    });
  };

  const begin = (what: Dragged, event: { clientX: number; clientY: number }, at_once: boolean, click?: () => void) => {
    follow_pointer(event, {
      from_px: at_once ? 0 : kDragFrom_px,
      ...(click ? { click } : {}),
      move: (moved) => follow.current?.(what, moved),
      drop: (dropped) => {
        // The text may have changed on the way: by another page, or another editor.
        const slot = slot_under(dropped);
        const now = "nodes" in what ? all_now(what.nodes) : null;
        if (slot && "nodes" in what && !now) useDesign.setState({ refused: `${named(what.nodes)} ${what.nodes.length === 1 ? "is" : "are"} not there any more` });
        else if (slot) {
          // The next keys are of what was dropped.
          svg.current?.focus({ preventScroll: true });
          void gesture(gesture_for(now ? { nodes: now } : what, slot, dropped.altKey));
        }
      },
      end: () => set_drag(null),
    });
    if (at_once) follow.current?.(what, event);
  };
  const press = (element: number, event: PointerEvent) => {
    const node = latest.current.tree.nodes.find((candidate) => candidate.element === element);
    if (!node) return;
    svg.current?.focus({ preventScroll: true });
    if (adds(event)) return toggle_chosen(node);
    // One of several takes the others along; who only clicks on it means it alone.
    const all = outermost(latest.current.tree, chosen_now());
    const among = all.length > 1 && chosen_now().includes(node);
    if (!among) choose(node);
    begin({ nodes: among ? all : [node] }, event, false, among ? () => choose(node) : undefined);
  };
  const draw_band = (event: PointerEvent) => {
    const from = at_picture(event);
    const to = (moved: PointerEvent): Rect => {
      const [x, y] = at_picture(moved);
      return { x: Math.min(x, from[0]), y: Math.min(y, from[1]), width: Math.abs(x - from[0]), height: Math.abs(y - from[1]) };
    };
    follow_pointer(event, {
      from_px: kDragFrom_px,
      move: (moved) => set_band(to(moved)),
      drop: (dropped) => {
        banded.current = true;
        svg.current?.focus({ preventScroll: true });
        const inside = nodes_inside(latest.current.tree, to(dropped));
        const before = chosen_now().filter((node) => !inside.includes(node));
        if (inside.length > 0) choose_nodes([...before, ...inside]);
      },
      end: () => set_band(null),
    });
    return true;
  };
  useImperativeHandle(handle, () => ({ drag: (what, event) => begin(what, event, true), add: (id, subtree) => add(id, subtree), fit: () => view.fit(), focus: () => svg.current?.focus() }));

  // ---- keys ----
  const node_of = (element: number | null) => tree.nodes.find((node) => node.element === element) ?? null;
  const children_of = (place: number) => tree.nodes.filter(({ parent }) => parent === place);
  const slot_of = (node: OutlineNode) => {
    const siblings = children_of(node.parent);
    return { parent: node.parent >= 0 ? tree.nodes[node.parent]!.element : tree.element, index: siblings.indexOf(node), count: siblings.length };
  };
  const ask_at = (node: OutlineNode | null, title: string, pick: (id: string, subtree: boolean) => void, leaves = true) => {
    const element = (node && svg.current?.querySelector(`[data-element="${node.element}"]`)) ?? svg.current;
    const at = element?.getBoundingClientRect();
    ask({ title, x: (at?.left ?? 0) + 10, y: node ? (at?.bottom ?? 0) + 4 : (at?.top ?? 0) + 60, leaves, pick });
  };
  const insert = (node: OutlineNode | null, slot: { parent: number; index: number }, title: string) => {
    const version = version_now();
    ask_at(node, title, (id, subtree) => void gesture({ what: "insert", id, ...(subtree ? { subtree } : {}), parent: slot.parent, index: slot.index }, version));
  };

  const slot_for_paste = (node: OutlineNode | null, pasted: readonly OutlineNode[]) => {
    const count = node ? children_of(tree.nodes.indexOf(node)).length : 0;
    const inside = !node || (count < node.children_max && !pasted.some(({ element }) => element === node.element));
    if (!node) return { parent: tree.element, index: 0 };
    if (inside || node.parent < 0) return { parent: node.element, index: count };
    const { parent, index } = slot_of(node);
    return { parent, index: index + 1 };
  };
  /** Into the chosen node if it takes one more, else after it. `text`: of the clipboard, where it could be read. */
  const paste = (node: OutlineNode | null, text: string) => {
    const { lines, kept } = pasted(text, useKept.getState().kept);
    if (is_xml(lines) && kept?.file !== file) return void gesture({ what: "paste", xml: lines, ...slot_for_paste(node, []) });
    const say = (refused: string) => useDesign.setState({ refused });
    if (!kept || kept.spent) return say(nothing_pasted(lines, "node"));
    if (kept.file !== file) return say(`${named(kept.nodes)} ${kept.nodes.length === 1 ? "was" : "were"} copied in ${kept.file}, and the clipboard cannot be read here: its text can be pasted`);
    const now = all_now(kept.nodes);
    if (!now) return say(`${named(kept.nodes)} ${kept.nodes.length === 1 ? "is" : "are"} not there any more`);
    void gesture({ what: "move", nodes: elements_of(now), ...slot_for_paste(node, now), ...(kept.cut ? {} : { copy: true }) }).then((done) => done && kept.cut && useKept.setState({ kept: { ...kept, cut: false, spent: true } }));
  };
  const add = (id: string, subtree: boolean) => {
    const node = node_of(chosen);
    const count = node ? children_of(tree.nodes.indexOf(node)).length : 0;
    const below = node !== null && (node.parent < 0 || (node.children_max > count && node.children_max > 0));
    const slot = !node ? { parent: tree.nodes[0]?.element ?? tree.element, index: tree.nodes.length > 0 ? children_of(0).length : 0 } : below ? { parent: node.element, index: count } : { ...slot_of(node), index: slot_of(node).index + 1 };
    svg.current?.focus({ preventScroll: true });
    void gesture(gesture_for({ id, subtree }, slot, false));
  };
  /** Then the nodes around it can be reached by key. */
  const remove = (nodes: readonly OutlineNode[]) => {
    const last = nodes.at(-1)!;
    const siblings = children_of(last.parent);
    const near_it = [...siblings.slice(siblings.indexOf(last)), ...siblings.reverse()].find((node) => !nodes.includes(node)) ?? tree.nodes[last.parent] ?? null;
    void gesture({ what: "delete", nodes: elements_of(nodes) }).then((done) => {
      const now = done && near_it && node_now(near_it);
      if (now) choose(now);
    });
  };
  const duplicate = (nodes: readonly OutlineNode[]) => {
    const last = nodes.at(-1)!;
    if (last.parent < 0) return useDesign.setState({ refused: "the root has no siblings" });
    const { parent, index } = slot_of(last);
    void gesture({ what: "move", nodes: elements_of(nodes), parent, index: index + 1, copy: true });
  };
  /** Among their siblings, or out of their parent. */
  const shift = (nodes: readonly OutlineNode[], where: "before" | "behind" | "out") => {
    const span = span_of(tree, nodes);
    if (!span) return useDesign.setState({ refused: "what is chosen is in different nodes: such nodes are moved by dragging them" });
    const parent = tree.nodes[nodes[0]!.parent];
    if (where === "out" && !parent) return;
    const slot = where === "out" ? { parent: slot_of(parent!).parent, index: slot_of(parent!).index + 1 } : { parent: span.parent, index: where === "before" ? span.first - 1 : span.last + 2 };
    void gesture({ what: "move", nodes: elements_of(nodes), ...slot }).then(() => svg.current?.focus());
  };
  /** Skipped whatever happens, or as others are again. */
  const toggle_disabled = (nodes: readonly OutlineNode[]) => {
    const enable = nodes.every(is_disabled);
    const own = nodes.find(({ attributes }) => attributes.some(([name, value]) => name === "_skipIf" && value !== "true"));
    if (own) return useDesign.setState({ refused: `${called_of(own)} has a _skipIf of its own, which would be lost` });
    void gesture({ what: "set", nodes: elements_of(nodes), name: "_skipIf", value: enable ? null : "true" });
  };

  const key = (event: React.KeyboardEvent) => {
    if (!in_turn(event)) return;
    const node = node_of(chosen);
    const all = chosen_now();
    const nodes = outermost(tree, all);
    const letter = event.key.toLowerCase();
    if (event.ctrlKey || event.metaKey) {
      if (letter === "a" && !event.shiftKey) {
        choose_nodes(tree.nodes, node ?? tree.nodes[0]);
        event.preventDefault();
        return;
      }
      if (["c", "x", "v"].includes(letter) && !event.shiftKey) {
        // What one presses comes with what is in the clipboard, as an event of its own.
        if (letter === "v" && event.nativeEvent.isTrusted) return;
        if (letter === "v") void clipboard_text().then((text) => paste(node, text));
        else if (node) keep(nodes, letter === "x");
        else return;
        event.preventDefault();
        event.stopPropagation();
        return;
      }
      if (!node || !["ArrowUp", "ArrowDown", "ArrowLeft", "ArrowRight"].includes(event.key)) return;
      shift(nodes, event.key === "ArrowUp" || event.key === "ArrowLeft" ? "before" : "behind");
    } else if (event.altKey) return;
    else if (event.key.startsWith("Arrow")) {
      const shape = new Map(tree.nodes.map((_, i) => [i, tree.layout.nodes[i]!] as const));
      const at = node ? tree.nodes.indexOf(node) : -1;
      const next = at < 0 ? 0 : neighbour(shape, (i) => tree.nodes[i]?.parent ?? -1, at, event.key as Arrow);
      const to = next === null ? undefined : tree.nodes[next];
      if (to && event.shiftKey) choose_nodes([...all.filter((one) => one !== to), to], to);
      else if (to) choose(to);
    } else if (all.length > 1 && kNodeCommands.some(({ key, held, alone }) => alone && !held?.ctrlKey && key.toLowerCase() === letter && (held?.shiftKey ?? false) === event.shiftKey)) {
      useDesign.setState({ refused: `${all.length} nodes are chosen; this is done to one of them alone` });
    } else if (event.key === "Home") choose(tree.nodes[0] ?? null);
    else if (event.key === "Enter") {
      if (!node) insert(null, { parent: tree.element, index: 0 }, "Root of the tree");
      else {
        const { parent, index } = slot_of(node);
        // The root has no siblings.
        if (node.parent < 0) insert(node, { parent: node.element, index: children_of(tree.nodes.indexOf(node)).length }, `New child of ${node.name || node.id}`);
        else insert(node, { parent, index: index + 1 }, `New node after ${node.name || node.id}`);
      }
    } else if (event.key === "Tab" && node) {
      if (!event.shiftKey) insert(node, { parent: node.element, index: children_of(tree.nodes.indexOf(node)).length }, `New child of ${called_of(node)}`);
      else if (nodes.some(({ parent }) => parent < 0)) return;
      else shift(nodes, "out");
    } else if (event.key === "Escape") choose(null);
    else if (!node) {
      if (!view.key(event, true)) return;
    } else if (event.key === "Delete" || event.key === "Backspace") remove(nodes);
    else if (letter === "w") ask_at(node, `Wrap ${named(nodes)} in`, (id) => void gesture({ what: "wrap", nodes: elements_of(all_now(nodes) ?? nodes), id }), false);
    else if (letter === "u") void gesture({ what: "unwrap", nodes: elements_of(all) });
    else if (letter === "e") void extract(node);
    else if (letter === "d") duplicate(nodes);
    else if (letter === "s") toggle_disabled(all);
    else if (event.key === "F2") focus_field("design-name");
    else if (letter === "m" || event.key === "ContextMenu") {
      const box = svg.current?.querySelector(`[data-element="${node.element}"]`)?.getBoundingClientRect();
      set_menu({ x: box?.left ?? 0, y: box?.bottom ?? 0 });
    }
    else if (!view.key(event, false)) return;
    event.preventDefault();
    event.stopPropagation();
  };

  usePaste(svg, (text) => paste(node_of(chosen), text));

  // The same by name, for who does not know the keys.
  const chosen_node = node_of(chosen);
  const all_chosen = nodes_of({ chosen: chosen_node && { element: chosen_node.element, key: "" }, also }, tree);
  const called = all_chosen.length === 0 ? "" : named(all_chosen);
  const commands = kNodeCommands.filter(({ alone }) => all_chosen.length < 2 || !alone);
  const of_node = kNodeCommands.map((command) => ({
    id: `design.tree.${command.keys}`,
    title: words_for(command, all_chosen),
    group: "Tree",
    keys_there: [command.keys],
    run: () => (chosen_node ? press_tree_key(command.key, command.held) : useDesign.setState({ refused: "choose a node first" })),
  }));
  useCommand({ id: "design.tree", title: "Go to the tree", group: "Tree", run: () => svg.current?.focus() }, ...of_node);

  return (
    <>
      <svg
        ref={svg}
        className={`picture tree-picture design-picture${why_dim ? " dim" : ""}${drag ? " dragging" : ""}`}
        // A tree of the page is never empty.
        role={tree.nodes.length > 0 ? "tree" : "group"}
        aria-multiselectable={tree.nodes.length > 0 ? true : undefined}
        aria-label={`Tree ${tree.id}`}
        aria-activedescendant={chosen === null ? undefined : `element-${chosen}`}
        tabIndex={0}
        data-testid="design-tree"
        onKeyDown={key}
        onClick={(event) => {
          if (event.target === svg.current && !banded.current && !adds(event)) choose(null);
        }}
        onDoubleClick={(event) => {
          const at = event.target instanceof Element ? event.target.closest("[data-element]")?.getAttribute("data-element") : null;
          const node = at ? node_of(Number(at)) : null;
          if (node) void open_node(node);
          else if (event.target === svg.current) view.fit();
        }}
        onContextMenu={(event) => {
          event.preventDefault();
          const at = event.target instanceof Element ? event.target.closest("[data-element]")?.getAttribute("data-element") : null;
          const under = at ? node_of(Number(at)) : null;
          if (!under || !chosen_now().includes(under)) choose(under);
          svg.current?.focus({ preventScroll: true });
          set_menu(at ? { x: event.clientX, y: event.clientY } : null);
        }}
      >
        <g ref={group}>
          <Links layout={tree.layout} />
          {tree.nodes.map((node, i) => (
            <NodeView key={node.element} said={said.get(node.from) ?? ""} run={run_status(node)} node={node} drawn={tree.layout.nodes[i]!} chosen={node.element === chosen} also={beside.has(node.element) || in_band.has(node)} near={is_near(i, node.parent, chosen_at, chosen_parent)} never={never.has(node.element)} findings={findings} level={levels[i]!} faded={dragged?.has(node.element) || cut.has(node) || false} disabled={is_disabled(node)} />
          ))}
          {tree.nodes.length === 0 && (
            <>
              <circle className="slot" cx={30} cy={30} r={9} />
              <text className="slot-hint" x={30} y={58} textAnchor="middle">
                Enter, or a drag from the palette, makes its root
              </text>
            </>
          )}
          <Played tree={tree} />
          {band && <rect className="band" data-testid="band" {...band} />}
          {drag?.slot && <SlotMark slot={drag.slot} into={rects.get(drag.slot.parent)} refused={drag.why_not !== null} />}
        </g>
      </svg>
      <Minimap view={view} box={box} rects={tree.layout.nodes} />
      {menu && chosen_node && (
        <Menu
          {...menu}
          close={() => set_menu(null)}
          label={called}
          head={<strong>{called}</strong>}
          // Once the menu has given the focus back.
          entries={commands.map((command) => ({ label: words_for(command, all_chosen), hint: command.keys, why_not, run: () => setTimeout(() => press_tree_key(command.key, command.held)) }))}
        />
      )}
      {drag && (
        <div className={`drag-label${drag.why_not ? " refused" : ""}`} style={{ left: drag.x + 14, top: drag.y + 12 }} role="status" data-testid="drag-label">
          {"nodes" in drag.what ? named(drag.what.nodes) : drag.what.id}
          {drag.slot && <small> {slot_words(tree, drag.slot)}</small>}
          {drag.why_not && <span> ✗ {drag.why_not}</span>}
        </div>
      )}
    </>
  );
}

/** Chooses beside what is chosen. */
const adds = (event: { shiftKey: boolean; ctrlKey: boolean; metaKey: boolean }) => event.shiftKey || event.ctrlKey || event.metaKey;

export function words_for({ title, of_subtree }: (typeof kNodeCommands)[number], nodes: readonly OutlineNode[]): string {
  const [node] = nodes;
  if (nodes.length > 1) return title.replace("NODE", named(nodes)).replace(/\bits place\b/, "their places").replace(/\bits\b/, "their").replace(/\bit\b/, "them");
  return (node?.kind === "subtree" && of_subtree ? of_subtree : title).replace("NODE", node ? called_of(node) : "the chosen node");
}

/** What is done to the chosen nodes by key. */
export const kNodeCommands: readonly { title: string; of_subtree?: string; keys: string; key: string; held?: { shiftKey?: boolean; ctrlKey?: boolean }; alone?: true }[] = [
  { title: "Add a node after NODE", keys: "Enter", key: "Enter", alone: true },
  { title: "Add a child to NODE", keys: "Tab", key: "Tab", alone: true },
  { title: "Move NODE out of its parent", keys: "Shift+Tab", key: "Tab", held: { shiftKey: true } },
  { title: "Move NODE before its sibling", keys: "Ctrl+↑", key: "ArrowUp", held: { ctrlKey: true } },
  { title: "Move NODE behind its sibling", keys: "Ctrl+↓", key: "ArrowDown", held: { ctrlKey: true } },
  { title: "Wrap NODE in another node", keys: "W", key: "w" },
  { title: "Put the children of NODE in its place", keys: "U", key: "u" },
  { title: "Make NODE a tree of its own", of_subtree: "Put the tree NODE in its place", keys: "E", key: "e", alone: true },
  { title: "Another NODE behind it", keys: "D", key: "d" },
  { title: "Disable NODE, or enable it", keys: "S", key: "s" },
  { title: "Copy NODE", keys: "Ctrl+C", key: "c", held: { ctrlKey: true } },
  { title: "Cut NODE, to paste it elsewhere", keys: "Ctrl+X", key: "x", held: { ctrlKey: true } },
  { title: "Paste into NODE, or after it", keys: "Ctrl+V", key: "v", held: { ctrlKey: true }, alone: true },
  { title: "Rename NODE", keys: "F2", key: "F2", alone: true },
  { title: "Delete NODE", keys: "Del", key: "Delete" },
];

/** As a tree of its own with a name that no other has; a SubTree: its tree in its place. */
async function extract(node: OutlineNode): Promise<void> {
  if (node.kind === "subtree") return void gesture({ what: "inline", node: node.element });
  const { palette } = useDesign.getState();
  const trees = doc_of(useDesign.getState())?.shown_trees ?? [];
  const nodes = [...palette.map(({ id }) => id), ...trees.flatMap((tree) => tree.nodes.filter(({ kind }) => kind !== "subtree").map((one) => one.id))];
  const id = name_of_tree(node.name || node.id, trees.map((tree) => tree.id), nodes);
  const tree = tree_of(useDesign.getState())?.id ?? null;
  if (!(await gesture({ what: "extract", node: node.element, id }))) return;
  // The picture stays with the tree in which the SubTree is now.
  useDesign.setState({ tree });
  choose(tree_of(useDesign.getState())?.nodes.find((one) => one.kind === "subtree" && one.id === id) ?? null);
}

const kNone: ReadonlySet<number> = new Set();

/** Elements of the leaves that are never ticked, while that is looked at. */
function useNever(tree: OutlineTree): ReadonlySet<number> {
  const lines = useReached((state) => state.never.node_lines);
  const doc = useDesign(doc_of);
  return useMemo(() => {
    if (lines.size === 0 || !doc) return kNone;
    const { places, file } = doc;
    const found = new Set<number>();
    let [line, at] = [1, 0];
    // Nodes stand in the order of the text.
    for (const { element, from, kind } of [...tree.nodes].sort((a, b) => a.from - b.from)) {
      const to = places.at(from);
      for (; at < to; at += 1) if (places.shown[at] === "\n") line += 1;
      if (is_never(lines.get(node_key(file, line)), kind)) found.add(element);
    }
    return found;
  }, [lines, doc, tree]);
}

/** What the nodes said in the last tick of the simulation, and the answers of the leaves to click. */
function Played({ tree }: { tree: OutlineTree }) {
  const played = useSimulation(({ on, tree: id, tree_now }) => (on && id === tree.id ? tree_now : null));
  if (!played) return null;
  const answers = new Map(played.leaves.map((leaf) => [leaf.leaf, leaf] as const));
  return (
    <g className="played">
      {tree.nodes.map((node, i) => {
        const now = played.nodes.find(({ at }) => at === node.from);
        if (!now) return null;
        const drawn = tree.layout.nodes[i]!;
        const { x, y, width, height } = drawn;
        const status = kStatuses.indexOf(now.status as (typeof kStatuses)[number]);
        const leaf = now.leaf === null ? null : answers.get(now.leaf);
        const offered = kAnswers.filter((answer) => answer.status !== "RUNNING" || !leaf?.condition);
        return (
          <g key={node.element} data-played={node.name || node.id} data-said={now.status} className={now.status.toLowerCase()}>
            {status > 0 && (
              <g transform={corner(drawn)}>
                <StatusSign status={status} />
              </g>
            )}
            {leaf &&
              offered.map(({ status: answer, sign, word }, n) => (
                <g
                  key={answer}
                  className={`played-answer${leaf.answer === answer ? " given" : ""}`}
                  data-answer={answer}
                  transform={`translate(${x + width / 2 + (n - (offered.length - 1) / 2) * 24} ${y + height + kAnswers_px / 2})`}
                  onPointerDown={(event) => event.stopPropagation()}
                  onClick={(event) => {
                    event.stopPropagation();
                    void play_tree({ do: "answer", leaf: leaf.leaf, status: answer });
                  }}
                >
                  <title>{`${leaf.name}: ${word}`}</title>
                  <circle r={10.5} />
                  <text y={4.5} textAnchor="middle">
                    {sign}
                  </text>
                </g>
              ))}
          </g>
        );
      })}
    </g>
  );
}

/** Where what is dragged will go, and the node that takes it. */
function SlotMark({ slot, into, refused }: { slot: SlotPlace; into: Rect | undefined; refused: boolean }) {
  return (
    <g className={`slot-mark${refused ? " refused" : ""}`} data-testid="slot-mark">
      {into && <rect x={into.x - 4} y={into.y - 4} width={into.width + 8} height={into.height + 8} rx={6} />}
      <path d={`M${slot.a[0]} ${slot.a[1]}L${slot.b[0]} ${slot.b[1]}`} />
    </g>
  );
}

interface NodeProps {
  said: string;
  /** In the run that is on show: its `status_code`. */
  run: number;
  node: OutlineNode;
  drawn: OutlineTree["layout"]["nodes"][number];
  chosen: boolean;
  /** Beside another one. */
  also: boolean;
  near: boolean;
  never: boolean;
  faded: boolean;
  disabled: boolean;
  /** How deep it is: the root is at 1. */
  level: number;
  findings: readonly Finding[];
}

const NodeView = memo(
  function NodeView({ said: played, run, node, drawn, chosen, also, near, never, faded, disabled, level, findings }: NodeProps) {
    const wrong = findings_at(findings, node);
    const errors = wrong.filter(({ severity }) => severity === "error").length;
    const called = node.name || node.id;
    // What is read aloud begins with what is to be seen.
    const [status, last] = statuses_of(run);
    const word = played || (status > 0 ? (kStatuses[status] ?? "").toLowerCase() : "");
    const said = [[drawn.symbol, ...drawn.title, ...drawn.lines].filter(Boolean).join(" "), ...(status > 0 ? [word] : last > 0 ? [`last ${last_word(last)}`] : []), ...(disabled ? ["disabled"] : []), ...(never ? ["never reached"] : []), ...wrong.map(({ message }) => message)].join("; ");
    return (
      <g
        id={`element-${node.element}`}
        data-element={node.element}
        data-name={called}
        data-errors={errors}
        data-status={run > 0 ? kStatuses[status || last_shown(last)] : undefined}
        className={["node", word === "failure" && node.kind === "condition" ? "no" : word, chosen ? "chosen" : near ? "near" : "", also ? "also" : "", disabled ? "disabled" : "", faded ? "faded" : "", node.known ? "" : "unknown", never ? "never-ticked" : ""].filter(Boolean).join(" ")}
        role="treeitem"
        aria-label={said}
        aria-level={level}
        aria-selected={chosen || also}
      >
        <title>{said}</title>
        {(chosen || also) && <rect className="halo" x={drawn.x - 5} y={drawn.y - 5} width={drawn.width + 10} height={drawn.height + 10} rx={7} />}
        <Outline drawn={drawn} />
        <Texts drawn={drawn} middle={drawn.x + drawn.width / 2} />
        {wrong.length === 0 && status > 0 && (
          <g transform={corner(drawn)}>
            <StatusSign status={status} />
          </g>
        )}
        {wrong.length === 0 && status === 0 && last > 0 && <LastSign last={last} transform={corner(drawn)} />}
        {wrong.length > 0 && (
          <g className={`finding ${errors > 0 ? "error" : "warning"}`} transform={corner(drawn)}>
            <circle r={9} />
            <text y={4} textAnchor="middle">
              {errors > 0 ? "!" : "?"}
            </text>
          </g>
        )}
      </g>
    );
  },
  (a, b) =>
    a.said === b.said && a.run === b.run && is_same_node(a.node, b.node) && is_same_drawn(a.drawn, b.drawn) && a.chosen === b.chosen && a.also === b.also && a.disabled === b.disabled && a.near === b.near && a.never === b.never && a.faded === b.faded && a.level === b.level && (a.findings === b.findings || (findings_at(a.findings, a.node).length === 0 && findings_at(b.findings, b.node).length === 0)),
);
