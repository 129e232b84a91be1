import { expect, it } from "vitest";

import { PageName, type Channel } from "./page_name";

/** Documents of one origin: what one says, the others hear. */
class Air {
  private readonly channels: Channel[] = [];
  channel(): Channel {
    const own: Channel = {
      onmessage: null,
      postMessage: (data) => {
        for (const other of this.channels) if (other !== own) other.onmessage?.({ data } as MessageEvent);
      },
    };
    this.channels.push(own);
    return own;
  }
}

function storage(copied?: { kept: ReadonlyMap<string, string> }) {
  const kept = new Map<string, string>(copied?.kept);
  return { kept, getItem: (key: string) => kept.get(key) ?? null, setItem: (key: string, value: string) => void kept.set(key, value) };
}

it("gives a duplicated tab a name of its own, and a page that is loaded anew the same", () => {
  const air = new Air();
  const own = storage();
  let renamed = 0;
  const first = new PageName(own, air.channel(), 1, () => (renamed += 1));
  const name = first.current;
  const copy = storage(own);
  const second = new PageName(copy, air.channel(), 2, () => (renamed += 1));
  expect(first.current).toBe(name);
  expect(second.current).not.toBe(name);
  expect(renamed).toBe(1);
  // Each keeps what it has now.
  expect(new PageName(copy, new Air().channel(), 3, () => undefined).current).toBe(second.current);
});

it("lets the older one keep the name, whichever speaks first", () => {
  const air = new Air();
  const own = storage();
  own.setItem("sentree.page", "both");
  const copy = storage(own);
  const young = new PageName(own, air.channel(), 2, () => undefined);
  const old = new PageName(copy, air.channel(), 1, () => undefined);
  expect(old.current).toBe("both");
  expect(young.current).not.toBe("both");
});
