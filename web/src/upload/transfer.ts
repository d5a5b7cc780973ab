/** Transfer an image to or from a car: the server runs the protocol, through its own port or one of the browser's. */

import { socketUrl } from "../api/http";
import type { Outcome, Progress, UploadAnswer } from "../generated/messages";

/** A port of the browser's Web Serial. */
export interface SerialPort {
  open(options: { baudRate: number }): Promise<void>;
  close(): Promise<void>;
  readonly readable: ReadableStream<Uint8Array<ArrayBuffer>>;
  readonly writable: WritableStream<Uint8Array>;
}

interface Serial {
  requestPort(): Promise<SerialPort>;
}

function serial(): Serial | undefined {
  return (navigator as Navigator & { serial?: Serial }).serial;
}

export const hasWebSerial = (): boolean => serial() !== undefined;

/** The port that the user chooses; null where they cancel. */
export async function requestPort(): Promise<SerialPort | null> {
  return (await serial()?.requestPort().catch(() => null)) ?? null;
}

/** Pass on the bytes that come from the port, and write bytes to it in order. */
export function carryBytes(port: SerialPort, onBytes: (bytes: Uint8Array<ArrayBuffer>) => void) {
  const reader = port.readable.getReader();
  const writer = port.writable.getWriter();
  const reading = (async () => {
    for (let next = await reader.read(); !next.done; next = await reader.read()) onBytes(next.value);
  })().catch(() => undefined);
  return {
    write: (bytes: ArrayBuffer) => void writer.write(new Uint8Array(bytes)).catch(() => undefined),
    close: async () => {
      await reader.cancel().catch(() => undefined);
      await reading;
      reader.releaseLock();
      await writer.close().catch(() => undefined);
      await port.close().catch(() => undefined);
    },
  };
}

export type Order = { image: string; verify: boolean } | { readback: true };

export type { Outcome, Progress };

/** The connection to the server ended before an outcome came. */
export class CutOffError extends Error {}

/** Follow a socket's messages to the outcome; `carry` receives bytes. */
function follow(socket: WebSocket, onProgress: (progress: Progress) => void, carry?: (bytes: ArrayBuffer) => void) {
  return new Promise<Outcome>((resolve, reject) => {
    socket.binaryType = "arraybuffer";
    socket.addEventListener("message", ({ data }: MessageEvent<string | ArrayBuffer>) => {
      if (typeof data !== "string") {
        carry?.(data);
        return;
      }
      const report = JSON.parse(data) as UploadAnswer;
      if ("outcome" in report) resolve(report);
      else onProgress(report);
    });
    socket.addEventListener("close", () => reject(new CutOffError()));
    socket.addEventListener("error", () => reject(new CutOffError()));
  });
}

/** Transfer through one of the server's own ports. */
export async function transfer(port: string, order: Order, onProgress: (progress: Progress) => void): Promise<Outcome> {
  const socket = new WebSocket(socketUrl("/api/upload"));
  socket.addEventListener("open", () => socket.send(JSON.stringify({ port, ...order })));
  try {
    return await follow(socket, onProgress);
  } finally {
    socket.close();
  }
}

/** Transfer through a port of the browser's: the page passes bytes between the port and the server. */
export async function transferBySerial(
  port: SerialPort,
  baudRate: number,
  order: Order,
  onProgress: (progress: Progress) => void,
): Promise<Outcome> {
  await port.open({ baudRate });
  const socket = new WebSocket(socketUrl("/api/serial"));
  const carrier = carryBytes(port, (bytes) => socket.readyState === WebSocket.OPEN && socket.send(bytes));
  socket.addEventListener("open", () => socket.send(JSON.stringify(order)));
  try {
    return await follow(socket, onProgress, carrier.write);
  } finally {
    socket.close();
    await carrier.close();
  }
}
