import { describe, expect, it } from "vitest";

import { Client, kRequestsMax, kRetryLast_ms, RefusedError, retry_wait_ms, socket_address, type Socket } from "./client";

class FakeSocket {
  sent: string[] = [];
  closed = false;
  onopen: (() => void) | null = null;
  onclose: (() => void) | null = null;
  onmessage: ((event: { data: unknown }) => void) | null = null;
  send(text: string) {
    this.sent.push(text);
  }
  close() {
    this.closed = true;
    this.onclose?.();
  }
  says(message: unknown) {
    this.onmessage?.({ data: JSON.stringify(message) });
  }
}

function make(token?: string) {
  const sockets: FakeSocket[] = [];
  const timers: (() => void)[] = [];
  const phases: string[] = [];
  const received: unknown[] = [];
  const client = new Client({
    open: () => {
      const socket = new FakeSocket();
      sockets.push(socket);
      return socket as unknown as Socket;
    },
    receive: (message) => received.push(message),
    phase: (phase) => phases.push(phase),
    set_timer: (callback) => timers.push(callback),
    clear_timer: () => undefined,
    ...(token === undefined ? {} : { token }),
  });
  client.start();
  return { client, sockets, timers, phases, received };
}

describe("a request", () => {
  it("gets the value of the answer with its id", async () => {
    const { client, sockets } = make();
    sockets[0]!.onopen?.();
    const first = client.request("seek", { time: 5 });
    const second = client.request("pause", {});
    const ids = sockets[0]!.sent.map((text) => (JSON.parse(text) as { id: number }).id);
    sockets[0]!.says({ type: "answer", id: ids[1], ok: true, value: "second" });
    sockets[0]!.says({ type: "answer", id: ids[0], ok: true, value: "first" });
    expect(await second).toBe("second");
    expect(await first).toBe("first");
  });

  it("is refused with the program's words", async () => {
    const { client, sockets } = make();
    sockets[0]!.onopen?.();
    const refused = client.request("pause", {});
    sockets[0]!.says({ type: "answer", id: 1, ok: false, error: "a recording cannot be steered" });
    await expect(refused).rejects.toThrow("a recording cannot be steered");
  });

  it("is refused when the connection is lost, and while there is none", async () => {
    const { client, sockets } = make();
    await expect(client.request("pause", {})).rejects.toBeInstanceOf(RefusedError);
    sockets[0]!.onopen?.();
    const pending = client.request("pause", {});
    sockets[0]!.onclose?.();
    await expect(pending).rejects.toThrow("connection was lost");
    await expect(client.request("pause", {})).rejects.toBeInstanceOf(RefusedError);
  });

  it("is refused at once when too many wait", async () => {
    const { client, sockets } = make();
    sockets[0]!.onopen?.();
    for (let i = 0; i < kRequestsMax; i++) client.request("pause", {}).catch(() => undefined);
    await expect(client.request("pause", {})).rejects.toThrow("too many");
  });
});

describe("a lost connection", () => {
  it("is opened again, after waits that double up to a bound", () => {
    const { sockets, timers, phases } = make();
    sockets[0]!.onopen?.();
    sockets[0]!.onclose?.();
    expect(phases).toEqual(["connecting", "open", "lost"]);
    timers.pop()?.();
    expect(sockets).toHaveLength(2);
    sockets[1]!.onopen?.();
    expect(phases.at(-1)).toBe("open");
    expect([1, 2, 3, 99].map(retry_wait_ms)).toEqual([250, 500, 1000, kRetryLast_ms]);
  });

  it("stays closed when the page stops it", () => {
    const { client, sockets, timers } = make();
    sockets[0]!.onopen?.();
    client.stop();
    expect(timers).toHaveLength(0);
  });

  it("ignores what an older socket still says", () => {
    const { sockets, timers, received } = make();
    sockets[0]!.onclose?.();
    timers.pop()?.();
    sockets[0]!.says({ type: "problem", text: "old", time: 0 });
    expect(received).toHaveLength(0);
  });
});

it("a token is shown to the program as soon as the socket is open", () => {
  const { sockets } = make("secret");
  sockets[0]!.onopen?.();
  expect(JSON.parse(sockets[0]!.sent[0] ?? "")).toMatchObject({ op: "hello", token: "secret" });
});

it("the socket's address follows the page's", () => {
  expect(socket_address({ protocol: "http:", host: "127.0.0.1:8080", pathname: "/" })).toBe("ws://127.0.0.1:8080/api/ws");
  expect(socket_address({ protocol: "https:", host: "robot", pathname: "/studio/index.html" })).toBe("wss://robot/studio/api/ws");
});
