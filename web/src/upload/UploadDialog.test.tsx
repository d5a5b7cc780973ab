import { cleanup, render, screen, waitFor } from "@testing-library/react";
import userEvent from "@testing-library/user-event";
import { afterEach, beforeAll, beforeEach, describe, expect, it } from "vitest";
import texts from "virtual:texts/studio";
import { connectTo } from "../api/service";
import { PlayedStream } from "../api/testStream";
import type { CompiledBlocks } from "../api/types";
import { startTexts } from "../i18n";
import { useSettings } from "../state/settings";
import { useStudio } from "../state/studio";
import { UploadDialog } from "./UploadDialog";

const PORTS = [
  { port: "/dev/ttyUSB0", description: "n/a", kind: "serial" },
  { port: "virtual:", description: "", kind: "virtual" },
];

beforeAll(() => startTexts(texts));
beforeEach(() => {
  connectTo({
    ask: (name) => Promise.resolve(name === "ports" ? PORTS : null) as never,
    openStream: (_, __, listeners) => new PlayedStream(listeners),
  });
  useSettings.setState({ port: null, uploaded: false });
  useStudio.setState({
    capabilities: { serial_ports: true, cars: "" } as never,
    compiled: { image: "AAAA" } as CompiledBlocks,
  });
});
afterEach(cleanup);

/** Press 'Upload' for a port; gives the stream to it. */
async function upload(user: ReturnType<typeof userEvent.setup>, port: RegExp): Promise<PlayedStream> {
  await user.click(await screen.findByRole("radio", { name: port }));
  await user.click(screen.getByRole("button", { name: "Upload" }));
  const stream = PlayedStream.all.at(-1)!;
  stream.open();
  return stream;
}

describe("an upload to a car", () => {
  it("begins with the simulated car, shows how far it is, and its outcome", async () => {
    const user = userEvent.setup({ delay: null });
    render(<UploadDialog />);
    await waitFor(() => expect(screen.getByRole<HTMLInputElement>("radio", { name: /Simulated car/ }).checked).toBe(true));
    const stream = await upload(user, /ttyUSB0/);
    expect(stream.messages).toEqual([{ port: "/dev/ttyUSB0", image: "AAAA", verify: true }]);
    stream.say({ sent: 2, of: 4 });
    await waitFor(() => expect(screen.getByRole("progressbar", { name: "2 of 4 bytes" }).getAttribute("aria-valuenow")).toBe("2"));
    stream.say({ outcome: "verified", answer: "OK 3" });
    expect((await screen.findByRole("status")).textContent).toContain("Verified");
    expect(screen.queryByRole("progressbar")).toBeNull();
    expect([useSettings.getState().port, useSettings.getState().uploaded]).toEqual(["/dev/ttyUSB0", true]);
  });

  it("says that it was cut off, and can be tried again", async () => {
    const user = userEvent.setup({ delay: null });
    render(<UploadDialog />);
    (await upload(user, /ttyUSB0/)).end();
    expect((await screen.findByRole("alert")).textContent).toContain("What the car holds now is not known");
    const again = await upload(user, /ttyUSB0/);
    await waitFor(() => expect(screen.queryByRole("alert")).toBeNull());
    again.say({ outcome: "not-verified" });
    expect((await screen.findByRole("status")).textContent).toContain("Sent, not verified.");
    expect(useSettings.getState().uploaded).toBe(true);
  });

  it("waits for blocks without mistakes; the car can still be read", async () => {
    useStudio.setState({ compiled: { image: null } as CompiledBlocks });
    render(<UploadDialog />);
    expect(screen.getByText(/First correct the problems/)).toBeTruthy();
    await waitFor(() => expect(screen.getByRole("button", { name: "Read back" }).matches(":disabled")).toBe(false));
    expect(screen.getByRole("button", { name: "Upload" }).matches(":disabled")).toBe(true);
  });
});
