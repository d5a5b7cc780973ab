/** Transfer an image to or from a car: the service runs the protocol, through its own port or one of the browser's. */

import { service, type Stream } from "../api/service";
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

/** The service was lost before an outcome came. */
export class CutOffError extends Error {}

/** Send an order and follow its stream to the outcome; `carry` receives bytes, `opened` the stream. */
async function follow(
  name: "upload" | "serial",
  order: object,
  onProgress: (progress: Progress) => void,
  carry?: (bytes: ArrayBuffer) => void,
  opened?: (stream: Stream) => void,
): Promise<Outcome> {
  let stream: Stream | undefined;
  try {
    return await new Promise<Outcome>((resolve, reject) => {
      stream = service().openStream(name, "", {
        onOpen: () => {
          stream!.send(JSON.stringify(order));
          opened?.(stream!);
        },
        onMessage: (data) => {
          if (typeof data !== "string") {
            carry?.(data);
            return;
          }
          const report = JSON.parse(data) as UploadAnswer;
          if ("outcome" in report) resolve(report);
          else onProgress(report);
        },
        onClose: () => reject(new CutOffError()),
      });
    });
  } finally {
    stream?.close();
  }
}

/** Transfer through one of the service's own ports. */
export async function transfer(port: string, order: Order, onProgress: (progress: Progress) => void): Promise<Outcome> {
  return await follow("upload", { port, ...order }, onProgress);
}

/** Transfer through a port of the browser's: the page passes bytes between the port and the service. */
export async function transferBySerial(
  port: SerialPort,
  baudRate: number,
  order: Order,
  onProgress: (progress: Progress) => void,
): Promise<Outcome> {
  await port.open({ baudRate });
  let stream: Stream | null = null;
  const carrier = carryBytes(port, (bytes) => stream?.send(bytes));
  try {
    return await follow("serial", order, onProgress, carrier.write, (opened) => (stream = opened));
  } finally {
    stream = null;
    await carrier.close();
  }
}
