import { Menu, type MenuEntry } from "../../widgets/Menu";
import { useEditing } from "../../store/edit";
import type { Index } from "../../store/store";
import { intervene, is_on, useSteering, useWhyNot } from "../steer/steering";
import { open_skill, toggle, useMission } from "./mission";

/** What can be done with a node. */
export function NodeMenu({ index, node: id, x, y, close }: { index: Index; node: number; x: number; y: number; close(): void }) {
  const why_not = useWhyNot();
  const standing = useSteering((steering) => steering.standing);
  const folded = useMission((mission) => mission.collapsed.has(id));
  const edit = useEditing();
  const node = index.model.tree.nodes[id];
  if (!node) return null;
  const own = standing.filter((entry) => is_on(entry, node));
  const entries: MenuEntry[] = [];
  if (node.leaf) entries.push({ label: "Open its skill's chart", hint: "Enter", run: () => open_skill(node.leaf!, id) });
  if ((index.children[id]?.length ?? 0) > 0) {
    entries.push({ label: folded ? "Show what is below" : "Hide what is below", hint: "Enter", run: () => toggle(id) });
  }
  if (edit) entries.push({ label: "Edit it", run: () => edit({ node: { id: node.type, name: node.name } }) });
  entries.push({ label: "Copy its path", run: () => void navigator.clipboard?.writeText(node.path) });
  entries.push({ heading: "Stop the run when it becomes" });
  for (const [label, status] of [["any status", ""], ["running", "RUNNING"], ["success", "SUCCESS"], ["failure", "FAILURE"]] as const) {
    const present = own.find((entry) => entry.kind === "breakpoint" && (entry.status ?? "") === status);
    entries.push({
      label,
      checked: present !== undefined,
      why_not,
      run: () =>
        void (present
          ? intervene({ clear: present.id })
          : intervene({ breakpoint: { node: node.path, ...(status === "" ? {} : { status }) } })),
    });
  }
  const leaf = node.message_name ?? (node.leaf ? node.leaf.replace(/^skill:/, "") : null);
  if (leaf !== null) {
    entries.push({ heading: "Force what it answers" });
    for (const status of ["SUCCESS", "FAILURE", "RUNNING"] as const) {
      const present = own.find((entry) => entry.kind === "force" && entry.status === status);
      entries.push({
        label: status.toLowerCase(),
        checked: present !== undefined,
        why_not,
        run: () => void (present ? intervene({ clear: present.id }) : intervene({ force: { leaf, status } })),
      });
    }
    entries.push({ label: "failure, once", why_not, run: () => void intervene({ force: { leaf, status: "FAILURE", count: 1 } }) });
    entries.push({ label: "success, once", why_not, run: () => void intervene({ force: { leaf, status: "SUCCESS", count: 1 } }) });
  }
  if (own.length > 0) {
    entries.push("line", { label: "Clear all of these", why_not, run: () => void Promise.all(own.map((entry) => intervene({ clear: entry.id }))) });
  }
  return <Menu x={x} y={y} close={close} label={`Node ${node.name}`} head={<><strong>{node.name}</strong> <span className="muted">{node.type}</span></>} entries={entries} />;
}
