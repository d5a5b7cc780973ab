import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { Link, useRemote } from "./link";

const LISTED = ["0", "1", "2"].map((car) => ({ car, leads: car === "0", sees: true, name: null }));

/** A server whose answers the test gives. */
class Server extends EventTarget {
  readyState: 0 | 1 | 2 | 3 = WebSocket.OPEN;
  received: Record<string, unknown>[] = [];
  send(text: string | ArrayBufferLike | Blob | ArrayBufferView): void {
    this.received.push(JSON.parse(text as string) as Record<string, unknown>);
  }
  close(): void {
    this.readyState = WebSocket.CLOSED;
    this.dispatchEvent(new Event("close"));
  }
  answer(message: unknown): void {
    this.dispatchEvent(new MessageEvent("message", { data: JSON.stringify(message) }));
  }
}

let servers: Server[] = [];
let nowMs = 0;

function opened(firstCar: string | null = null): { link: Link; server: Server } {
  const connect = () => {
    servers.push(new Server());
    return servers.at(-1)!;
  };
  const link = new Link(connect, () => nowMs);
  link.open(firstCar);
  servers[0]!.answer({ is: "hello", cars: LISTED });
  return { link, server: servers[0]! };
}

beforeEach(() => {
  servers = [];
  nowMs = 0;
  vi.useFakeTimers();
  useRemote.setState(useRemote.getInitialState(), true);
});
afterEach(() => vi.useRealTimers());

describe("a link", () => {
  it("joins the first car, or the one that is asked for", () => {
    expect(opened().server.received).toEqual([{ do: "join", car: "0" }]);
    servers = [];
    useRemote.setState(useRemote.getInitialState(), true);
    expect(opened("2").server.received).toEqual([{ do: "join", car: "2" }]);
  });

  it("drives all cars that it joined with one message of two axes", () => {
    const { link, server } = opened();
    link.join("1");
    link.drive({ throttle: 0.5, steering: -1 });
    expect(server.received.at(-1)).toEqual({ do: "drive", cars: ["0", "1"], throttle: 0.5, steering: -1, number: 1 });
    link.leave("0");
    link.stopAll();
    expect(server.received.at(-1)).toEqual({ do: "stop", cars: ["1"] });
  });

  it("measures the time from a stick to its answer", () => {
    const { link, server } = opened();
    link.drive({ throttle: 1, steering: 0 });
    nowMs = 37;
    server.answer({ is: "heard", number: 1 });
    expect(useRemote.getState().roundTripMs).toBe(37);
    server.answer({ is: "heard", number: 999 });
    expect(useRemote.getState().roundTripMs).toBe(37);
  });

  it("comes back by itself, joins the same cars, and shows nothing old meanwhile", () => {
    const { link, server } = opened();
    link.join("2");
    server.answer({ is: "telemetry", cars: { 0: { state: "moving" } } });
    server.close();
    expect(useRemote.getState()).toMatchObject({ open: false, telemetry: {} });
    link.drive({ throttle: 1, steering: 0 });
    vi.advanceTimersByTime(1000);
    expect(servers).toHaveLength(2);
    servers[1]!.answer({ is: "hello", cars: LISTED });
    expect(servers[1]!.received).toEqual([
      { do: "join", car: "0" },
      { do: "join", car: "2" },
    ]);
    expect(useRemote.getState()).toMatchObject({ open: true, joined: ["0", "2"] });
  });

  it("tries less and less often", () => {
    opened();
    for (let k = 0; k < 20; k++) {
      servers.at(-1)!.close();
      vi.advanceTimersByTime(4000);
    }
    expect(servers.length).toBeLessThanOrEqual(22);
    const before = servers.length;
    servers.at(-1)!.close();
    vi.advanceTimersByTime(1000);
    expect(servers).toHaveLength(before);
  });

  it("leaves cars that are there no longer", () => {
    const { link, server } = opened();
    link.join("2");
    server.answer({ is: "hello", cars: LISTED.slice(0, 2) });
    expect(useRemote.getState().joined).toEqual(["0"]);
  });
});
