import type { Operation, Operations, ServerMessage } from "./types";

/** What the client needs of a WebSocket; tests give another. */
export type Socket = Pick<WebSocket, "send" | "close" | "onopen" | "onclose" | "onmessage">;
export type Phase = "connecting" | "open" | "lost";

export interface ClientOptions {
  open(): Socket;
  receive(message: Exclude<ServerMessage, { type: "answer" }>): void;
  phase(phase: Phase, attempt: number): void;
  /** Allows to steer when the program does not listen on loopback. */
  token?: string;
  /** What the page calls itself now. */
  page?(): string;
  /** The program has said whether this page may steer. */
  greeted?(may_steer: boolean): void;
  set_timer?: (callback: () => void, milliseconds: number) => number;
  clear_timer?: (timer: number) => void;
}

/** An operation that the program refused, or whose answer cannot come any more. */
export class RefusedError extends Error {}
/** The program cannot be reached; whether it has done what was asked is not known. */
export class LostError extends RefusedError {}
/** Nothing was asked: too much waits already. Later it can be. */
export class BusyError extends RefusedError {}

/** Waits between attempts to connect: doubling from the first to the last. */
export const kRetryFirst_ms = 250;
export const kRetryLast_ms = 4000;
/** Requests that may wait for their answers; more are refused at once. */
export const kRequestsMax = 256;

/** Keeps one WebSocket open, and joins answers with requests. */
export class Client {
  private socket: Socket | null = null;
  private attempt = 0;
  private timer = 0;
  private next_id = 1;
  private closed = false;
  private readonly waiting = new Map<number, { resolve(value: unknown): void; reject(error: Error): void }>();
  private readonly set_timer: (callback: () => void, milliseconds: number) => number;
  private readonly clear_timer: (timer: number) => void;

  constructor(private readonly options: ClientOptions) {
    this.set_timer = options.set_timer ?? ((callback, ms) => window.setTimeout(callback, ms));
    this.clear_timer = options.clear_timer ?? ((timer) => window.clearTimeout(timer));
  }

  start(): void {
    this.closed = false;
    this.connect();
  }

  stop(): void {
    this.closed = true;
    this.clear_timer(this.timer);
    this.socket?.close();
    this.drop();
  }

  /** Connects now instead of at the next attempt. */
  retry(): void {
    if (this.socket || this.closed) return;
    this.clear_timer(this.timer);
    this.connect();
  }

  request<Op extends Operation>(op: Op, args: Operations[Op][0]): Promise<Operations[Op][1]> {
    const socket = this.socket;
    if (!socket || this.attempt > 0) return Promise.reject(new LostError("not connected to the program"));
    if (this.waiting.size >= kRequestsMax) return Promise.reject(new BusyError("too many requests wait for an answer"));
    const id = this.next_id++;
    return new Promise((resolve, reject) => {
      this.waiting.set(id, { resolve: resolve as (value: unknown) => void, reject });
      socket.send(JSON.stringify({ op, id, ...args }));
    });
  }

  /** Tells the program who this is. */
  greet(): void {
    const { token, page, greeted } = this.options;
    if (token === undefined && page === undefined) return;
    void this.request("hello", { ...(token === undefined ? {} : { token }), ...(page === undefined ? {} : { page: page() }) }).then(({ steerable }) => greeted?.(steerable), () => undefined);
  }

  private connect(): void {
    this.attempt += 1;
    this.options.phase(this.attempt === 1 ? "connecting" : "lost", this.attempt);
    const socket = this.options.open();
    this.socket = socket;
    socket.onopen = () => {
      if (this.socket !== socket) return;
      this.attempt = 0;
      this.options.phase("open", 0);
      this.greet();
    };
    socket.onmessage = (event) => {
      if (this.socket === socket && typeof event.data === "string") this.receive(event.data);
    };
    socket.onclose = () => {
      if (this.socket !== socket) return;
      this.drop();
      if (this.closed) return;
      const attempt = Math.max(this.attempt, 1);
      this.attempt = attempt;
      this.options.phase("lost", attempt);
      this.timer = this.set_timer(() => this.connect(), retry_wait_ms(attempt));
    };
  }

  private drop(): void {
    this.socket = null;
    const waiting = [...this.waiting.values()];
    this.waiting.clear();
    for (const { reject } of waiting) reject(new LostError("the connection was lost"));
  }

  private receive(text: string): void {
    const message = JSON.parse(text) as ServerMessage;
    if (message.type !== "answer") {
      this.options.receive(message);
      return;
    }
    const waiting = this.waiting.get(message.id);
    if (!waiting) return;
    this.waiting.delete(message.id);
    if (message.ok) waiting.resolve(message.value);
    else waiting.reject(new RefusedError(message.error ?? "refused"));
  }
}

export function retry_wait_ms(attempt: number): number {
  return Math.min(kRetryLast_ms, kRetryFirst_ms * 2 ** Math.min(attempt - 1, 10));
}

/** The address of the program that served this page. */
export function socket_address(location: { protocol: string; host: string; pathname: string }): string {
  const folder = location.pathname.replace(/[^/]*$/, "");
  return `${location.protocol === "https:" ? "wss:" : "ws:"}//${location.host}${folder}api/ws`;
}
