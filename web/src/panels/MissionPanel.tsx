import "../styles/picture.css";
import "../styles/mission.css";

import { useEffect, useMemo, useRef, useState } from "react";

import { kStatuses } from "../protocol/types";
import { Icon } from "../widgets/Icon";
import { PanelTools } from "../widgets/PanelTools";
import { useCommand } from "../widgets/commands";
import { useStudio } from "../store/store";
import { PictureTools } from "../picture/PictureTools";
import { AtWork } from "./mission/AtWork";
import { Inspector } from "./mission/Inspector";
import { collapse_all, expand_all, jump_to, useMission } from "./mission/mission";
import { StatusSign } from "./mission/StatusSign";
import { search } from "./mission/tree";
import { TreePicture, type TreeHandle } from "./mission/TreePicture";

export function MissionPanel() {
  const index = useStudio((studio) => studio.index);
  const chosen = useStudio((studio) => studio.selection.node);
  const follow = useMission((mission) => mission.follow);
  const ages = useMission((mission) => mission.ages);
  const inspecting = useMission((mission) => mission.inspecting);
  const folded = useMission((mission) => mission.collapsed.size > 0);
  const picture = useRef<TreeHandle>(null);

  useCommand(
    { id: "mission.search", title: "Search in the tree", group: "Mission", keys: ["Ctrl+F"], run: () => document.getElementById("mission-search")?.focus() },
    { id: "mission.follow", title: "Follow what is at work in the tree", group: "Mission", keys: ["F"], run: () => useMission.setState({ follow: !follow }) },
    { id: "mission.collapse", title: "Collapse the tree", group: "Mission", run: collapse_all },
    { id: "mission.expand", title: "Expand the tree", group: "Mission", run: expand_all },
    { id: "mission.ages", title: "Ages of statuses in the tree", group: "Mission", run: () => useMission.setState({ ages: !ages }) },
    { id: "mission.inspect", title: "Ports and blackboard beside the tree", group: "Mission", keys: ["P"], run: () => useMission.setState({ inspecting: !inspecting }) },
  );

  if (!index) return <div className="empty">Waiting for the mission …</div>;
  return (
    <div className="mission">
      <PanelTools>
        <Search />
        <button className="button small" aria-pressed={inspecting} title="Ports and blackboard of the chosen node (P)" onClick={() => useMission.setState({ inspecting: !inspecting })}>
          Inspect
        </button>
        <PictureTools
          panel="mission"
          id="mission"
          name="tree"
          fit={() => picture.current?.fit()}
          zoom={(factor) => picture.current?.zoom(factor)}
          more={[
            { label: "Follow what is at work", hint: "F", checked: follow, run: () => useMission.setState({ follow: !follow }) },
            { label: "Ages of statuses", checked: ages, run: () => useMission.setState({ ages: !ages }) },
            { label: folded ? "Show all nodes" : "Hide everything below the first level", run: folded ? expand_all : collapse_all },
          ]}
        />
      </PanelTools>
      <div className="mission-body">
        <div className="mission-picture">
          <TreePicture index={index} handle={picture} />
        </div>
        {inspecting && <Inspector index={index} node={chosen} close={() => useMission.setState({ inspecting: false })} />}
      </div>
      <AtWork index={index}>
        <Legend />
      </AtWork>
    </div>
  );
}

/** Finds nodes; Enter goes from one to the next. */
function Search() {
  const nodes = useStudio((studio) => studio.index?.model.tree.nodes);
  const [text, set_text] = useState("");
  const [at, set_at] = useState(-1);
  const found = useMemo(() => search(nodes ?? [], text), [nodes, text]);
  useEffect(() => useMission.setState({ found: new Set(found) }), [found]);
  const go = (step: number) => {
    if (found.length === 0) return;
    const next = at < 0 && step < 0 ? found.length - 1 : (at + step + found.length) % found.length;
    set_at(next);
    jump_to(found[next]!);
  };
  return (
    <div className="search" role="search">
      <Icon name="search" />
      <input
        id="mission-search"
        className="field"
        type="search"
        placeholder="Find a node"
        aria-label="Find a node by name, type, path or port"
        value={text}
        onChange={(event) => {
          set_text(event.target.value);
          set_at(-1);
        }}
        onKeyDown={(event) => {
          if (event.key === "Enter") go(event.shiftKey ? -1 : 1);
          if (event.key === "Escape") {
            set_text("");
            event.currentTarget.blur();
          }
        }}
      />
      {text !== "" && (
        <span className="search-count number" role="status">
          {found.length === 0 ? "none" : at < 0 ? String(found.length) : `${at + 1}/${found.length}`}
        </span>
      )}
    </div>
  );
}

function Legend() {
  return (
    <ul className="legend" aria-label="What the signs mean">
      {kStatuses.slice(1).map((status) => (
        <li key={status} className={status.toLowerCase()}>
          <svg className="legend-sign" viewBox="-9 -9 18 18" aria-hidden="true">
            <StatusSign status={kStatuses.indexOf(status)} />
          </svg>
          {status.toLowerCase()}
        </li>
      ))}
    </ul>
  );
}
