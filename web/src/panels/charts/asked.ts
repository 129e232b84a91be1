import type { Selection } from "../../store/store";

/** Whether somebody chose something that has a chart, which was not only followed. */
export function asks_for_chart(now: Selection, before: Selection, is_leaf: (node: number) => boolean): boolean {
  if (now === before || now.chart === null) return false;
  if (now.chart !== before.chart || now.monitor !== before.monitor) return true;
  const of_leaf = now.node !== null && is_leaf(now.node);
  // The same once more is chosen too; another message alone is not.
  return now.node !== before.node ? of_leaf : now.sequence === before.sequence && (of_leaf || now.monitor !== null);
}
