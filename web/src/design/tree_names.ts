/** The ID of a tree that is made of a node called `from`: of no other tree and, as BehaviorTree.CPP demands, of no node. */
export function name_of_tree(from: string, trees: readonly string[], nodes: readonly string[]): string {
  const own = from.replace(/[^\p{L}\p{N}_]/gu, "_").replace(/^(?=\d)/, "_");
  const wanted = nodes.includes(own) ? `${own}Tree` : own;
  const taken = new Set([...trees, ...nodes]);
  let id = wanted;
  for (let number = 2; taken.has(id); number++) id = `${wanted}${number}`;
  return id;
}
