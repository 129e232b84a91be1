import { data_text, duration_text } from "../../draw/format";
import { kStatuses, type Data } from "../../protocol/types";
import { Icon } from "../../widgets/Icon";
import { useStudio, type Index } from "../../store/store";
import { jump_to, open_skill } from "./mission";
import { StatusSign } from "./StatusSign";
import { Transitions } from "./Transitions";
import { scope_of } from "./tree";

/** The chosen node with its ports, and the blackboard that it sees. */
export function Inspector({ index, node: id, close }: { index: Index; node: number | null; close(): void }) {
  const node = id === null ? undefined : index.model.tree.nodes[id];
  const blackboard = useStudio((studio) => studio.state?.blackboard);
  const outputs = useStudio((studio) => (node ? studio.state?.outputs?.[node.message_name ?? ""] : undefined));
  const scope = node ? scope_of(index.model.tree.nodes, node.id, Object.keys(blackboard ?? {})) : "";
  return (
    <aside className="inspector" aria-label="The chosen node">
      <header className="inspector-head">
        <strong className="ellipsis">{node ? node.name : "Blackboard"}</strong>
        <button className="icon-button" aria-label="Close" title="Close (P)" onClick={close}>
          <Icon name="close" />
        </button>
      </header>
      <div className="inspector-content">
        {node ? (
          <>
            <p className="muted">
              {node.type} · {node.kind}
            </p>
            <p className="mono path" title="Path in the tree">{node.path}</p>
            <Status id={node.id} />
            {node.leaf && (
              <button className="button small" onClick={() => open_skill(node.leaf!, node.id)}>
                <Icon name="chart" />
                Open its skill
              </button>
            )}
            {node.parent !== null && (
              <button className="button small" onClick={() => jump_to(node.parent!)}>
                Parent
              </button>
            )}
            {node.ports.length > 0 && (
              <Table
                title="Ports"
                rows={node.ports.map((port) => ({
                  key: port.name,
                  mark: kDirections[port.direction],
                  written: port.value,
                  value: port_value(port, blackboard?.[scope], outputs),
                }))}
              />
            )}
          </>
        ) : (
          <p className="muted">Choose a node to see its ports.</p>
        )}
        {Object.entries(blackboard ?? {})
          .filter(([key]) => !node || key === scope)
          .map(([key, entries]) => (
            <Table key={key} title={key === "" ? "Blackboard" : `Blackboard of ${key}`} rows={Object.entries(entries).map(([name, value]) => ({ key: name, value }))} />
          ))}
        {node && <Transitions node={node} />}
      </div>
    </aside>
  );
}

const kDirections = { input: "in", output: "out", inout: "in/out" } as const;

/** The value behind `{key}`; what is written as it is needs none. */
function port_value(port: { name: string; value: string }, blackboard: Record<string, Data> | undefined, outputs: Record<string, Data> | undefined): Data | undefined {
  const key = /^\{(.*)\}$/.exec(port.value.trim())?.[1];
  if (key === undefined) return outputs?.[port.name];
  return blackboard?.[key === "=" ? port.name : key] ?? outputs?.[port.name];
}

function Status({ id }: { id: number }) {
  const status = useStudio((studio) => studio.state?.tree.status[id] ?? 0);
  const last = useStudio((studio) => studio.state?.tree.last[id] ?? 0);
  const age = useStudio((studio) => (studio.state ? duration_text(Math.floor((studio.state.time - (studio.state.tree.since[id] ?? 0)) / 1e8) * 1e8) : ""));
  const word = (kStatuses[status] ?? "IDLE").toLowerCase();
  return (
    <p className="inspector-status">
      <span className={`badge ${word}`}>
        {status > 0 && (
          <svg className={`chip-sign ${word}`} viewBox="-9 -9 18 18" aria-hidden="true">
            <StatusSign status={status} />
          </svg>
        )}
        {kStatuses[status]}
      </span>
      <span className="muted number">
        for {age}
        {status === 0 && last > 0 ? `; before that ${(kStatuses[last] ?? "").toLowerCase()}` : ""}
      </span>
    </p>
  );
}

interface Row {
  key: string;
  mark?: string;
  written?: string;
  value: Data | undefined;
}

export function Table({ title, rows }: { title: string; rows: readonly Row[] }) {
  return (
    <section className="values">
      <h3>{title}</h3>
      {rows.length === 0 ? (
        <p className="muted">empty</p>
      ) : (
        <dl>
          {rows.map((row) => (
            <div className="value-row" key={row.key}>
              <dt title={row.key}>
                {row.key}
                {row.mark && <span className="mark">{row.mark}</span>}
              </dt>
              <dd>
                {row.written !== undefined && <span className="mono">{row.written}</span>}
                {row.value !== undefined && (
                  <span className="mono value" title={data_text(row.value, 2000)}>
                    {row.written !== undefined ? "= " : ""}
                    {data_text(row.value, 120) || "“”"}
                  </span>
                )}
              </dd>
            </div>
          ))}
        </dl>
      )}
    </section>
  );
}
