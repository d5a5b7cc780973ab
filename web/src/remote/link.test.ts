import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { Link, useRemote } from "./link";

const LISTED = ["0", "1", "2"].map((car) => ({ car, leads: car === "0", sees: true, name: null }));

/** A server that the test plays. */
class Server extends EventTarget {
  readyState: 0 | 1 | 2 | 3 = WebSocket.OPEN;
  said: Record<string, unknown>[] = [];
  send(text: string | ArrayBufferLike | Blob | ArrayBufferView): void {
    this.said.push(JSON.parse(text as string) as Record<string, unknown>);
  }
  close(): void {
    this.readyState = WebSocket.CLOSED;
    this.dispatchEvent(new Event("close"));
  }
  tell(message: unknown): void {
    this.dispatchEvent(new MessageEvent("message", { data: JSON.stringify(message) }));
  }
}

let servers: Server[] = [];
let nowMs = 0;

function begun(wished: string | null = null): { link: Link; server: Server } {
  const connect = () => {
    servers.push(new Server());
    return servers.at(-1)!;
  };
  const link = new Link(connect, () => nowMs, wished);
  link.begin();
  servers[0]!.tell({ is: "hello", cars: LISTED });
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
  it("sits at the first car, or at the one that the address names", () => {
    expect(begun().server.said).toEqual([{ do: "join", car: "0" }]);
    servers = [];
    useRemote.setState(useRemote.getInitialState(), true);
    expect(begun("2").server.said).toEqual([{ do: "join", car: "2" }]);
  });

  it("drives all cars at which it sits with one message of two axes", () => {
    const { link, server } = begun();
    link.sit("1");
    link.drive({ throttle: 0.5, steering: -1 });
    expect(server.said.at(-1)).toEqual({ do: "drive", cars: ["0", "1"], throttle: 0.5, steering: -1, number: 1 });
    link.leave("0");
    link.stopAll();
    expect(server.said.at(-1)).toEqual({ do: "stop", cars: ["1"] });
  });

  it("knows how long a stick is on its way", () => {
    const { link, server } = begun();
    link.drive({ throttle: 1, steering: 0 });
    nowMs = 37;
    server.tell({ is: "heard", number: 1 });
    expect(useRemote.getState().roundTripMs).toBe(37);
    server.tell({ is: "heard", number: 999 });
    expect(useRemote.getState().roundTripMs).toBe(37);
  });

  it("comes back by itself, sits where it sat, and shows nothing old meanwhile", () => {
    const { link, server } = begun();
    link.sit("2");
    server.tell({ is: "telemetry", cars: { 0: { state: "moving" } } });
    server.close();
    expect(useRemote.getState()).toMatchObject({ open: false, told: {} });
    link.drive({ throttle: 1, steering: 0 });
    vi.advanceTimersByTime(1000);
    expect(servers).toHaveLength(2);
    servers[1]!.tell({ is: "hello", cars: LISTED });
    expect(servers[1]!.said).toEqual([
      { do: "join", car: "0" },
      { do: "join", car: "2" },
    ]);
    expect(useRemote.getState()).toMatchObject({ open: true, seats: ["0", "2"] });
  });

  it("tries less and less often", () => {
    begun();
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
    const { link, server } = begun();
    link.sit("2");
    server.tell({ is: "hello", cars: LISTED.slice(0, 2) });
    expect(useRemote.getState().seats).toEqual(["0"]);
  });
});
