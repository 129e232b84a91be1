const collator = new Intl.Collator("en", { numeric: true });

/** Orders names as people do: leaf2 before leaf10. */
export const by_name = (a: string, b: string): number => collator.compare(a, b);
