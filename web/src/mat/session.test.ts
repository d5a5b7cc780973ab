import { afterEach, expect, it, vi } from "vitest";
import { Session } from "./session";
import { useMat } from "./store";

class MockSocket {
  static last: MockSocket;
  onopen!: () => void;
  onmessage!: (message: { data: string }) => void;
  onclose!: () => void;
  constructor() {
    MockSocket.last = this;
  }
  close(): void {
    this.onclose();
  }
}

afterEach(() => vi.unstubAllGlobals());

it("waits for the simulator until there is a world, or none can be", () => {
  vi.stubGlobal("WebSocket", MockSocket);
  const session = new Session();
  session.open();
  const says = (answer: object) => MockSocket.last.onmessage({ data: JSON.stringify(answer) });
  MockSocket.last.onopen();
  for (const end of [{ is: "hello", cars: 1, resumed: true }, { is: "error", code: "bad-world", details: {}, sentence: { en: "" } }]) {
    expect(useMat.getState().compiling).toBe(false);
    says({ is: "compiling" });
    expect(useMat.getState().compiling).toBe(true);
    says(end);
  }
  expect(useMat.getState().compiling).toBe(false);
  session.close();
});
