/** Transfer an image to or from a car: the service runs the protocol, through its own port or one of the browser's. */

import { service, type Stream } from "../api/service";
import type { Outcome, Progress, UploadAnswer } from "../generated/messages";

/** A port of the browser's Web Serial. Each non-fatal fault of the line replaces `readable`; it is null once the port is gone. */
export interface SerialPort extends EventTarget {
  open(options: { baudRate: number }): Promise<void>;
  close(): Promise<void>;
  readonly readable: ReadableStream<Uint8Array<ArrayBuffer>> | null;
  readonly writable: WritableStream<Uint8Array> | null;
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

/**
 * Pass on the bytes that come from the port, and write bytes to it in order.
 *
 * @param port an open port.
 * @param onBytes called for bytes that came.
 * @param onGone called once, when the port is gone: somebody pulled the cable.
 */
function carryBytes(port: SerialPort, onBytes: (bytes: Uint8Array<ArrayBuffer>) => void, onGone: () => void) {
  let reader: ReadableStreamDefaultReader<Uint8Array<ArrayBuffer>> | null = null;
  const writer = port.writable?.getWriter();
  const over = new AbortController();
  const { signal } = over;
  const gone = () => {
    if (!signal.aborted) onGone();
    over.abort();
  };
  const reading = (async () => {
    for (let last = null, stream = port.readable; stream && stream !== last && !signal.aborted; last = stream, stream = port.readable) {
      reader = stream.getReader();
      try {
        for (let next = await reader.read(); !next.done; next = await reader.read()) onBytes(next.value);
      } catch {
        // A byte was damaged, or the port is gone: then it has no other stream.
      }
      reader.releaseLock();
    }
    gone();
  })();
  port.addEventListener("disconnect", gone, { signal });
  return {
    write: (bytes: ArrayBuffer) => void writer?.write(new Uint8Array(bytes)).catch(gone),
    close: async () => {
      over.abort();
      await reader?.cancel().catch(() => undefined);
      await reading;
      await writer?.close().catch(() => undefined);
      await port.close().catch(() => undefined);
    },
  };
}

export type Order = { image: string; verify: boolean } | { readback: true };

export type { Outcome, Progress };

/** The service was lost before an outcome came. */
export class CutOffError extends Error {}

/** The browser can't open the port. */
export class PortBusyError extends Error {}

/** Tells the service that the port is gone: a text is no byte of it. */
const GONE = "gone";

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
      stream = service.openStream(name, "", {
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
  await port.open({ baudRate }).catch(() => {
    throw new PortBusyError();
  });
  let stream: Stream | null = null;
  let isGone = false;
  const carrier = carryBytes(
    port,
    (bytes) => stream?.send(bytes),
    () => {
      isGone = true;
      stream?.send(GONE);
    },
  );
  try {
    return await follow("serial", order, onProgress, carrier.write, (opened) => {
      stream = opened;
      if (isGone) stream.send(GONE);
    });
  } finally {
    stream = null;
    await carrier.close();
  }
}
